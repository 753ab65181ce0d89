"""Select the objects that an instruction means: "the red cups", "three cans", "everything but the bowl".

Plain rules over nouns, adjectives and numbers ensure that the same words always mean the same objects. Only a
noun that no table and no name knows is compared with them by its sentence embedding, if an encoder is given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from grounding.references.attributes import SceneObject
from grounding.references.candidates import Candidates, SelectionError
from grounding.references.function_words import SPATIAL_PREPOSITIONS
from grounding.references.mentions import read_mentions
from grounding.references.object_names import as_named, rivals, vocabulary
from grounding.references.phrases import ANY, Mention, References, Vocabulary
from grounding.references.word_forms import FORMS, singular

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

_MOST_CHARACTERS = 200_000  # beyond, a text is no instruction, and only its beginning is read


class AmbiguousReferenceError(SelectionError):
    """Raised if several objects fit words for a single one, such as "the red cup" if there are two.

    Attributes:
        phrase: the words of the text.
        indices: the indices of the objects that may be meant.
    """

    def __init__(self, phrase: str, indices: Sequence[int], descriptions: Sequence[str]) -> None:
        self.phrase, self.indices = phrase, tuple(indices)
        super().__init__(f"{phrase!r} can be each of {len(indices)} objects: {'; '.join(descriptions)}; which one?")


@dataclass(frozen=True)
class Selection:
    """The objects that an instruction means.

    Attributes:
        indices: into the scene's objects, ascending.
        named: the nouns that selected them, as singulars with the adjectives that distinguished them, in the order of
            the text; empty for "everything".
        excluded: the nouns that the instruction leaves out.
        required: those of the indices that were named one by one or by number, so that fewer will not do.
        described: whether a colour or a size selected the objects.
        notes: remarks on the selection, a sentence each, such as adjectives that could not be judged.
        references: the noun phrases that chose them; `None` for a choice that no words made.
    """

    indices: tuple[int, ...]
    named: tuple[str, ...] = ()
    excluded: tuple[str, ...] = ()
    required: tuple[int, ...] = ()
    described: bool = False
    notes: tuple[str, ...] = ()
    references: References | None = None


def select_objects(
    text: str | References,
    objects: Sequence[SceneObject | str | None],
    encoder: SentenceEncoder | None = None,
    *,
    catalogue: bool = False,
    resolved: Mapping[str, int] | None = None,
) -> Selection:
    """Select the objects that the instruction means.

    A plural means all of its kind, a number as many of them, and "the mug" the only one that there is;
    without any noun, everything is meant. Colours and sizes choose where the scene knows them, other
    adjectives and the first parts of compounds where the names hold them.

    Args:
        text: the instruction, any string; or its noun phrases, where they were read before, so that they are not
            read again (a scene that is drawn for an instruction).
        objects: the objects of the scene, or what each is called: a noun ("mug"), a compound ("soup can",
            "005_tomato_soup_can") or a description ("object 3, red, tall"); empty, `None` or "object" for
            an object without a name.
        encoder: finds what a noun means that neither the tables nor the names know.
        catalogue: the objects are those that a scene can be drawn from: sizes, which compare what stands
            there, are not judged, and any of several may be "the mug".
        resolved: phrase -> index of the object that an answer chose for it.

    Raises:
        AmbiguousReferenceError: if several objects fit words for a single one.
        SelectionError: for a noun of which no object, or too few objects, are there, for an adjective that
            fits none of them, and for an instruction that leaves nothing.
    """
    there = [each if isinstance(each, SceneObject) else SceneObject(each or "") for each in objects]
    if isinstance(text, References):
        references = text
    else:
        names = [each.name for each in there]
        references = read_mentions(as_named(text[:_MOST_CHARACTERS], names), vocabulary(names))
    return _Choice(references, Candidates(there, encoder, catalogue), dict(resolved or {})).select()


def mentioned(text: str) -> tuple[str, ...]:
    """List the objects that the instruction names, in its own words, if no scene is known: `("three cans",)`.

    Only exceptions give "everything but ..."; an instruction that names nothing, or everything, gives
    an empty tuple.
    """
    references = read_mentions(text[:_MOST_CHARACTERS], Vocabulary(FORMS))
    targets = [m for m in _targets(references) if m.noun != ANY or m.exact or any(map(rivals, m.modifiers))]
    left_out = references.by_role("left out")

    def words(mention: Mention) -> str:
        return " ".join(text[slice(*mention.span)].split())

    if targets:
        # "that row of cups ... the cups" names them once.
        last = {(m.noun, m.modifiers and m.exact): m for m in reversed(targets)}
        said = [words(m) for m in targets if last[(m.noun, m.modifiers and m.exact)] is m] + [
            f"not {_with_article(words(m))}" for m in left_out
        ]
        return tuple(dict.fromkeys(said))
    listed = " and ".join(dict.fromkeys(_with_article(words(m)) for m in left_out))
    return (f"everything but {listed}",) if listed else ()


def _with_article(words: str) -> str:
    """Return the noun phrase as it follows "but": "the bowl"; plurals and numbers need no article."""
    last = words.lower().split()[-1]
    bare = " " not in words and singular(last) == last and not FORMS.get(last, ("", False))[1]
    return f"the {words}" if bare else words


def _targets(references: References) -> list[Mention]:
    """Return the mentions that select objects; none if all objects are meant."""
    if targets := references.by_role("target"):
        return targets
    narrated = [
        replace(m, count=None, exact=False) if m.plural else m for m in references.by_role("narrated") if m.known
    ]
    several = [m for m in narrated if m.plural] or (narrated if len(narrated) > 1 else [])
    if references.pronoun:
        return several
    return []


class _Choice:
    """The choice of objects for one instruction."""

    def __init__(self, references: References, there: Candidates, resolved: Mapping[str, int]) -> None:
        self.references, self.there, self.resolved = references, there, resolved

    def select(self) -> Selection:
        left_out: set[int] = set()
        excluded = self.references.by_role("left out")
        for mention in excluded:
            found = self.there.matching(mention)
            if not found and (not mention.known or self.there.kinds_of(mention)):
                raise SelectionError(self.there.missing(mention, "leaves out"))
            # Of several bowls, "the bowl" that must not be touched may be any of them.
            left_out.update(found[: mention.count] if mention.exact and (mention.count or 0) > 0 else found)
        said = _targets(self.references)
        targets = [m for m in said if m.noun != ANY or self.there.chooses(m)]
        chosen: set[int] = set()
        required: set[int] = set()
        for mention in targets:
            found = self._chosen(mention, left_out, chosen)
            chosen.update(found)
            required.update(found if mention.count is not None else ())
        if not targets:
            chosen = set(range(len(self.there.names))) - left_out
        self._refuse_relations(chosen)
        if not chosen:
            raise SelectionError(f"the instruction leaves no object to move; there is: {self.there.inventory()}")
        return Selection(
            tuple(sorted(chosen)),
            tuple(dict.fromkeys(self.there.label(m) for m in targets if m.noun != ANY or self.there.judged(m))),
            tuple(dict.fromkeys(m.noun for m in excluded)),
            tuple(sorted(required)),
            any(self.there.judged(m) for m in (*targets, *excluded)),
            self.there.notes((*said, *excluded)),
            self.references,
        )

    def _refuse_relations(self, chosen: set[int]) -> None:
        """Refuse a place relative to an object that does not itself take part: "behind the plate".

        Raises:
            SelectionError: with the words that say so.
        """
        if self.there.catalogue:
            return
        for mention in self.references.mentions:
            if mention.role != "landmark" or mention.preposition not in SPATIAL_PREPOSITIONS or mention.noun == ANY:
                continue
            found = set(self.there.matching(mention)) if mention.known else set()
            if found and (not self.references.by_role("target") or not found & chosen):
                words = " ".join(self.references.text[slice(*mention.span)].split())
                raise SelectionError(
                    f"the instruction speaks of a place {mention.preposition!r} {words!r}, and a structure cannot be "
                    "placed relative to single objects yet"
                )

    def _chosen(self, mention: Mention, left_out: set[int], before: set[int]) -> list[int]:
        found = [i for i in self.there.matching(mention) if i not in left_out]
        if not found or (mention.exact and len(found) < abs(mention.count or 0)):
            raise SelectionError(self.there.missing(mention, "names"))
        # Which of a library are the largest two is seen when some of them stand on the table.
        if mention.count is None or (self.there.catalogue and self.there.sized(mention)):
            return found
        if mention.count < 0:
            return found[: len(found) + mention.count]
        # "the cracker box and the sugar box" are two boxes
        fresh = [i for i in found if i not in before] or found
        phrase = " ".join(self.references.text[slice(*mention.span)].split())
        if phrase in self.resolved:
            return [self.resolved[phrase]]
        descriptions = [self.there.description(i) for i in fresh]
        # Objects of one description cannot be told apart in words: any of them will do.
        if len(fresh) <= mention.count or len(set(descriptions)) < 2 or self.there.catalogue:
            return fresh[: mention.count]
        if words := self.there.unjudged(mention):
            raise SelectionError(
                f"it is not known which of the objects here are {words[0]!r}, so that {phrase!r} can be each of: "
                + "; ".join(descriptions)
            )
        if self._particular(mention):
            raise AmbiguousReferenceError(phrase, fresh, descriptions)
        return fresh[: mention.count]

    def _particular(self, mention: Mention) -> bool:
        """Return whether the mention means particular objects: "the red cup", "the two tallest"."""
        one = mention.definite and mention.count == 1 and not mention.exact
        return one or self.there.superlative(mention)
