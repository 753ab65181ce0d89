"""Which of the scene's objects an instruction means: "the red cups", "three cans", "everything but the bowl".

Plain rules over nouns, adjectives and numbers, so that the same words always mean the same objects. Only a
noun that no table and no name knows is compared with them by its sentence embedding, if an encoder is given.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from grounding.mentions import read_mentions
from grounding.names import UNKNOWN_CATEGORY, adjective, guesses, read_name, rivals, vocabulary
from grounding.nouns import FILLINGS, FORMS, GROUPS, KINDS, meanings, singular
from grounding.phrases import ANY, Mention, Reading, Vocabulary

if TYPE_CHECKING:
    from grounding.encoder import SentenceEncoder

_MOST_CHARACTERS = 200_000  # beyond, a text is no instruction, and only its beginning is read


class SelectionError(ValueError):
    """An object was named that is not there; the message lists what is."""


@dataclass(frozen=True)
class Selection:
    """The objects that an instruction means.

    Attributes:
        indices: into the scene's objects, ascending.
        named: the nouns that chose them, as singulars, in the order of the text; empty for "everything".
        excluded: the nouns that the instruction leaves out.
    """

    indices: tuple[int, ...]
    named: tuple[str, ...] = ()
    excluded: tuple[str, ...] = ()


def select_objects(
    text: str, names: Sequence[str | None], encoder: SentenceEncoder | None = None
) -> Selection:
    """The objects that the instruction means.

    A plural means all of its kind, a number as many of them, and a singular one, from the front of
    the list; without any noun, everything is meant. Adjectives and the first parts of compounds
    choose where the names hold them.

    Args:
        text: the instruction, any string.
        names: what each object in the scene is called: a noun ("mug"), a compound ("soup can",
            "005_tomato_soup_can") or a description ("object 3, red, tall"); empty, `None` or "object" for
            an object without a name.
        encoder: finds what a noun means that neither the tables nor the names know.

    Raises:
        SelectionError: for a noun of which no object, or too few objects, are there, and for an
            instruction that leaves nothing.
    """
    return _Scene(names, encoder).select(read_mentions(text[:_MOST_CHARACTERS], vocabulary(names)))


def mentioned(text: str) -> tuple[str, ...]:
    """What the instruction names, in its own words, where no scene is known: `("three cans",)`.

    Only exceptions give "everything but ..."; an instruction that names nothing, or everything, gives
    an empty tuple.
    """
    reading = read_mentions(text[:_MOST_CHARACTERS], Vocabulary(FORMS))
    meant = [m for m in _meant(reading) if m.noun != ANY or m.exact or any(map(rivals, m.modifiers))]
    left_out = [m for m in reading.mentions if m.role == "left out"]

    def words(mention: Mention) -> str:
        return " ".join(text[slice(*mention.span)].split())

    if meant:
        # "that row of cups ... the cups" names them once.
        last = {(m.noun, m.modifiers and m.exact): m for m in reversed(meant)}
        said = [words(m) for m in meant if last[(m.noun, m.modifiers and m.exact)] is m] + [
            f"not {_with_article(words(m))}" for m in left_out
        ]
        return tuple(dict.fromkeys(said))
    listed = " and ".join(dict.fromkeys(_with_article(words(m)) for m in left_out))
    return (f"everything but {listed}",) if listed else ()


def _with_article(words: str) -> str:
    """The noun phrase as it follows "but": "the bowl"; plurals and numbers need nothing."""
    last = words.lower().split()[-1]
    bare = " " not in words and singular(last) == last and not FORMS.get(last, ("", False))[1]
    return f"the {words}" if bare else words


def _meant(reading: Reading) -> list[Mention]:
    """The mentions that choose; none where everything is meant."""
    by_role = {
        role: [m for m in reading.mentions if m.role == role] for role in ("meant", "told", "landmark")
    }
    if by_role["meant"]:
        return by_role["meant"]
    told = [replace(m, count=None, exact=False) if m.plural else m for m in by_role["told"] if m.known]
    several = [m for m in told if m.plural] or (told if len(told) > 1 else [])
    if reading.pronoun:
        return several
    return []


class _Scene:
    def __init__(self, names: Sequence[str | None], encoder: SentenceEncoder | None) -> None:
        self.names = [name if name and name.strip() else UNKNOWN_CATEGORY for name in names]
        self.read = [read_name(name) for name in self.names]
        self.encoder = encoder
        self.unnamed = all(not name.head and not name.words for name in self.read)
        self._found: dict[tuple[object, ...], list[int]] = {}

    def select(self, reading: Reading) -> Selection:
        left_out: set[int] = set()
        excluded = [m for m in reading.mentions if m.role == "left out"]
        for mention in excluded:
            found = self._matches(mention)
            if not found and not mention.known:
                raise SelectionError(f"the instruction leaves out {mention.noun!r}; {self._there()}")
            # Of several bowls, "the bowl" that must not be touched may be any of them.
            left_out.update(found[: mention.count] if mention.exact and (mention.count or 0) > 0 else found)
        meant = [m for m in _meant(reading) if m.noun != ANY or self._chooses(m)]
        chosen: set[int] = set()
        for mention in meant:
            chosen.update(self._chosen(mention, left_out, chosen))
        if not meant:
            chosen = set(range(len(self.names))) - left_out
        if not chosen:
            raise SelectionError(f"the instruction leaves no object to move; there is: {self._inventory()}")
        return Selection(
            tuple(sorted(chosen)),
            tuple(dict.fromkeys(m.noun for m in meant if m.noun != ANY)),
            tuple(dict.fromkeys(m.noun for m in excluded)),
        )

    def _chosen(self, mention: Mention, left_out: set[int], before: set[int]) -> list[int]:
        found = [i for i in self._matches(mention) if i not in left_out]
        if not found or (mention.exact and len(found) < abs(mention.count or 0)):
            asked = " ".join((*self._telling(mention), mention.noun))
            asked = (
                f"{abs(mention.count or 0)} of {asked!r}" if mention.exact and mention.count else repr(asked)
            )
            raise SelectionError(f"the instruction names {asked}; {self._there()}")
        if mention.count is None:
            return found
        if mention.count < 0:
            return found[: len(found) + mention.count]
        # "the cracker box and the sugar box" are two boxes
        fresh = [i for i in found if i not in before]
        return (fresh or found)[: mention.count]

    def _chooses(self, mention: Mention) -> bool:
        """Whether a mention without a noun says more than "everything"."""
        return bool(mention.exact or mention.numbers or mention.ordinal or self._telling(mention))

    def _telling(self, mention: Mention) -> list[str]:
        """The modifiers that can say which object is meant."""
        held = {word for name in self.read for word in name.words}
        return [w for w in mention.modifiers if adjective(w) in held or rivals(adjective(w))]

    def _matches(self, mention: Mention) -> list[int]:
        key = (mention.noun, mention.modifiers, mention.numbers, mention.ordinal)
        if key not in self._found:
            found = self._described(self._of_noun(mention), [adjective(word) for word in mention.modifiers])
            if any(self.read[i].number is not None for i in found) and mention.numbers:
                found = [i for i in found if self.read[i].number in mention.numbers]
            elif mention.numbers and mention.noun == ANY:
                found = [number - 1 for number in mention.numbers if 0 < number <= len(self.names)]
            if mention.ordinal is not None:
                found = found[-1:] if mention.ordinal < 0 else found[mention.ordinal - 1 : mention.ordinal]
            self._found[key] = found
        return self._found[key]

    def _of_noun(self, mention: Mention) -> list[int]:
        if mention.noun == ANY:
            return list(range(len(self.names)))
        if mention.known:
            return self._called(mention.noun)
        heads = sorted({name.head for name in self.read if name.head})
        return next(
            (found for noun in guesses(mention.noun, heads, self.encoder) if (found := self._called(noun))),
            [],
        )

    def _called(self, noun: str) -> list[int]:
        """The objects that a known noun can mean."""
        itself, *others = meanings(noun)
        if found := self._of_kinds(itself, noun):
            return found
        # The mustard is in the mustard bottle; but the cups are not the cup rack.
        filled = noun in FILLINGS or noun not in FORMS
        if found := [
            i for i, n in enumerate(self.read) if noun in n.words and (filled or n.head not in KINDS)
        ]:
            return found
        return next((found for kinds in others if (found := self._of_kinds(kinds, noun))), [])

    def _of_kinds(self, kinds: Sequence[str], noun: str) -> list[int]:
        """The objects of these kinds; a toy car is a toy."""
        group = noun in GROUPS
        return [i for i, n in enumerate(self.read) if n.head in kinds or (group and noun in n.words)]

    def _described(self, found: list[int], adjectives: list[str]) -> list[int]:
        """Those of the found objects that the adjectives fit, where the names say anything about it."""
        for word in adjectives:
            holding = [i for i in found if word in self.read[i].words]
            # A green cup is none of those that are called red.
            found = holding or [i for i in found if not set(rivals(word)) & set(self.read[i].words)]
        return found

    def _there(self) -> str:
        if self.unnamed:
            return f"the objects have no names; there is only: {self._inventory()}"
        return f"there is only: {self._inventory()}"

    def _inventory(self) -> str:
        if self.unnamed:
            return ", ".join(f"object {number}" for number in range(1, len(self.names) + 1)) or "nothing"
        counted = Counter(self.names)
        parts = (f"{number} x {name}" if number > 1 else name for name, number in counted.items())
        return ("; " if any("," in name for name in counted) else ", ").join(parts) or "nothing"
