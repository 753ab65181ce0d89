"""Find the objects of a scene that noun phrases mean: by noun, colour, size, number, place and neighbours."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.standing_places import PlaceError, StandingPlaces
from grounding.parse_result import OBJECT, Question
from grounding.references.attributes import COMPARATIVES, MEASURES, SUPERLATIVES, SceneObject, is_color
from grounding.references.candidates import Candidates
from grounding.references.phrases import ANY, Mention

_ONE_THING = re.compile(r"(?:the|that|this|one) (?:thing|object|item|one)\b", re.IGNORECASE)
_SHARE = re.compile(
    r"(?:about |roughly )?(?:half|most|a few|few|several|some of|many of|a handful|part of|a third|a quarter)\b", re.IGNORECASE
)


class ReadingError(ValueError):
    """An instruction that cannot be read into a goal; the message says why."""


class ReadingQuestion(ReadingError):
    """An instruction with a doubt; `question` is what must be known."""

    def __init__(self, question: Question) -> None:
        self.question = question
        super().__init__(question.text)


class UnjudgedError(ReadingError):
    """A choice of objects by something that nothing here can tell, such as "the clean ones"."""


class SceneReferences:
    """The meaning of noun phrases in one scene, or without one.

    Args:
        objects: what is there; `None` where no scene is known: then the words stand for the objects.
        encoder: finds what a noun means that neither the tables nor the names know.
        catalogue: whether they are a library that a scene can be drawn from: any of several may be meant then.
        opposite: whether the speaker sits across the table.
    """

    def __init__(self, objects: Sequence[SceneObject] | None, encoder: object, catalogue: bool, opposite: bool) -> None:
        self.objects, self.encoder, self.catalogue = objects, encoder, catalogue
        self.candidates = Candidates(objects, encoder, catalogue) if objects is not None else None
        self.places = StandingPlaces(objects or (), opposite)
        self.subject: tuple[object, ...] | None = None  # what is placed, for "of the same colour"
        self.by_place = False
        self.scope: NounPhrase | None = None  # "of the three red cups, ..."
        self.described = False
        self.notes: list[str] = []
        self.nouns: list[str] = []
        self._chosen: dict[str, tuple[int, ...]] = {}
        self._nouns: list[NounPhrase] = []  # that were said, the last one last, for "the blue one"
        self._named: set[int] = set()  # objects that were meant before, for "the other one"
        self._found: dict[tuple[int, int, str, str], tuple[int, ...]] = {}

    def remember(self, named: Sequence[object]) -> None:
        """Keep objects that were named before the instruction, for "the other one" and "the blue one"."""
        for index in named:
            if isinstance(index, int) and self.candidates is not None and self.candidates.head(index):
                noun = Mention(self.candidates.head(index), (), 1, False, "target", True, False, (), None, (0, 0))
                self._nouns.append(NounPhrase("objects", 0, 0, self.candidates.names[index], noun))
                self._named.add(index)

    @property
    def count(self) -> int | None:
        """Return how many objects are there; `None` where no scene is known."""
        return None if self.objects is None else len(self.objects)

    def find(self, phrase: NounPhrase) -> tuple[int, ...] | tuple[str, ...]:
        """Find the objects that a phrase with a noun means; the same ones each time.

        Raises:
            ReadingError: where none or too few fit, with what is there.
            ReadingQuestion: where several fit a phrase that speaks of one.
        """
        if phrase.kind not in ("objects", "rest"):
            raise ReadingError(f"it is not clear which objects {phrase.text!r} means here; name them")
        if self.objects is None:
            return (_words(phrase),)
        key = (phrase.first, phrase.end, phrase.text, phrase.kind)
        if key not in self._found:
            self._found[key] = tuple(self._meant(phrase))
            self._named.update(self._found[key])
        return self._found[key]

    def landmark_of(self, phrase: NounPhrase) -> tuple[int, ...]:
        """Find the objects by whose place a phrase chooses others; nothing where it does not."""
        if phrase.landmark is None or phrase.landmark.mention is None or self.objects is None or self.catalogue:
            return ()
        return tuple(self._meant(phrase.landmark))

    def left_out_of(self, phrase: NounPhrase) -> set[int]:
        """Find the objects that a phrase, or the list that it ends, leaves out."""
        if self.objects is None or phrase.kind != "objects":
            return set()
        return {i for without in phrase.without for i in self._meant(without)}

    def _meant(self, phrase: NounPhrase) -> list[int]:
        mention = phrase.mention
        if mention is None:
            raise ReadingError(f"it is not clear which objects {phrase.text!r} means here; name them")
        try:
            found = self.fitting(phrase)
        except PlaceError as error:
            raise ReadingError(f"{error}, so that {phrase.text!r} cannot be told from the others") from error
        too_few = mention.exact and mention.count is not None and len(found) < mention.count and not self.catalogue
        if not found or too_few:
            raise ReadingError(self._missing(phrase))
        for without in phrase.without:
            out = set(self._meant(without))
            found = [i for i in found if i not in out]
        if not found:
            raise ReadingError(f"nothing is left of {phrase.text!r}; there is: {self.candidates.inventory()}")
        return self._counted(phrase, found)

    def fitting(self, phrase: NounPhrase) -> list[int]:
        """List the objects that a phrase fits, however many it speaks of; the best first where it compares them."""
        assert self.candidates is not None and phrase.mention is not None
        mention, found = self._of_noun(phrase)
        for more in phrase.either:
            fitting = self.candidates.matching(replace(more, noun=mention.noun, known=mention.known))
            found = found + [i for i in fitting if i not in found]
        self._nouns.append(replace(phrase, mention=mention))
        if self.candidates.judged(mention):
            self.described = True
        if mention.noun != ANY or self.candidates.judged(mention):
            self.nouns.append(self.candidates.label(mention))
        if mention.noun == ANY and (words := self.candidates.unjudged(mention)) and not self.catalogue:
            raise UnjudgedError(f"it is not known which of the objects here are {words[0]!r}; name them")
        self.notes += self.candidates.notes([mention])
        if self.catalogue:
            return found
        if (among := phrase.among or self._scope_of(phrase)) is not None:
            group = set(self._meant(among))
            found = [i for i in found if i in group]
        if phrase.other and self._named & set(found):
            found = [i for i in found if i not in self._named]
        if phrase.alike:
            found = self._alike(phrase, found)
        elif phrase.landmark is not None:
            found = self.places.beside(phrase, found, self._meant(phrase.landmark))
        if phrase.side is not None or phrase.ordinal is not None:
            found = self.places.on_side(phrase, found)
            self.by_place = True
        return found

    def _scope_of(self, phrase: NounPhrase) -> NounPhrase | None:
        """Return the group of which a phrase without a noun speaks; the group itself, "the two blue ones", is of none."""
        scope = self.scope
        if scope is None or not phrase.borrowed or (phrase.first, phrase.end) == (scope.first, scope.end):
            return None
        return scope

    def ambiguous(self, phrase: NounPhrase) -> bool:
        """Tell whether a phrase for one object fits several, as far as its noun and adjectives say."""
        said = phrase.mention
        if phrase.kind != "objects" or said is None or said.plural or not said.known or phrase.side or phrase.landmark:
            return False
        if self.candidates is None or self.catalogue:
            return phrase.borrowed and not said.modifiers
        return not self.candidates.superlative(said) and len(self.candidates.matching(said)) > 1

    def _of_noun(self, phrase: NounPhrase) -> tuple[Mention, list[int]]:
        """Find the objects of the noun and its adjectives; "the blue one" has the last noun of which there are several.

        Returns:
            What the phrase says with the noun and the adjectives that it leaves out, and the objects.
        """
        assert self.candidates is not None and phrase.mention is not None
        several: tuple[Mention, list[int]] | None = None
        scope = self._scope_of(phrase)
        before_it = [scope] if scope is not None else reversed(self._nouns)
        for before in before_it if phrase.borrowed else ():
            if before.mention.noun == ANY:
                continue
            for modifiers in dict.fromkeys((_left_out(phrase, before), ())):
                borrowed = replace(
                    phrase.mention, noun=before.mention.noun, known=before.mention.known,
                    modifiers=(*modifiers, *phrase.mention.modifiers),
                )  # fmt: skip
                found = self.candidates.matching(borrowed)
                if set(found) <= set(self.subject or ()):
                    continue  # "the blue ball next to the blue one": another one than itself
                if found and len(self.candidates.kinds_of(borrowed)) > 1:
                    return borrowed, found
                several = several or ((borrowed, found) if found else None)
        return several or (phrase.mention, self.candidates.matching(phrase.mention))

    def _alike(self, phrase: NounPhrase, found: list[int]) -> list[int]:
        """Keep the objects of the colour of the landmark, or of what is placed."""
        models = self._meant(phrase.landmark) if phrase.landmark is not None else self.subject
        colours = {
            attributes.colors[0] for i in models or ()
            if isinstance(i, int) and (attributes := self.objects[i].attributes) is not None and attributes.colors
        }  # fmt: skip
        if len(colours) != 1:
            raise ReadingError(f"it is not clear which colour is meant with {phrase.text!r}; name it")
        return [
            i for i in found
            if i not in (models or ()) and (own := self.objects[i].attributes) is not None and own.colors[:1] == tuple(colours)
        ]  # fmt: skip

    def rest(self, phrase: NounPhrase, taken: set[int]) -> tuple[int, ...] | None:
        """Find what "the other three" means: those of the last noun that are left, or else all that is left.

        Args:
            phrase: with the number of objects that it speaks of.
            taken: objects of other parts.

        Raises:
            ReadingError: where another number is left.
        """
        if self.objects is None or phrase.left is None or self.catalogue:
            return None
        left = [i for i in range(len(self.objects)) if i not in taken]
        for noun in reversed(self._nouns):
            said = replace(noun.mention, count=None, ordinal=None)
            for same in (self.candidates.matching(said), self.candidates.kinds_of(said)):
                same = [i for i in same if i in left]
                if len(same) == phrase.left:
                    return tuple(same)
        if len(left) != phrase.left:
            raise ReadingError(
                f"{phrase.text!r} speaks of {phrase.left} objects, and {len(left)} are left: {'; '.join(self._descriptions(left)) or 'none'}"
            )
        return tuple(left)

    # Numbers

    def _counted(self, phrase: NounPhrase, found: list[int]) -> list[int]:
        mention = phrase.mention
        if mention.count is None and _SHARE.match(phrase.text) and len(found) > 1 and not self.catalogue:
            raise ReadingQuestion(self._question(phrase.text, found))
        if mention.count is None and _ONE_THING.match(phrase.text) and len(found) > 1 and not self.catalogue:
            raise ReadingQuestion(self._question(phrase.text, found))  # "the thing I write with" is one of the pens
        if mention.count is None:
            return sorted(found)
        if mention.count < 0:
            return found[: len(found) + mention.count]
        compared = phrase.side is not None or any(word in SUPERLATIVES for word in mention.modifiers)
        if self.catalogue:
            return self._of_library(phrase, found)
        if len(found) <= mention.count or (not mention.definite and mention.exact):
            return found[: mention.count]
        if not mention.definite and _indefinite(phrase):
            fresh = [i for i in found if i not in self._named]
            return (fresh if len(fresh) >= mention.count else found)[: mention.count]
        if compared and not self.candidates.superlative(mention):
            return found[: mention.count]
        again = [i for i in found if i in self._named]
        if mention.definite and mention.count == 1 and len(again) == 1 and not mention.modifiers:
            return again  # "put the red mug on the plate, then turn to the mug"
        if words := self.candidates.unjudged(mention):
            raise UnjudgedError(
                f"it is not known which of the objects here are {words[0]!r}, so that {phrase.text!r} can be each of: "
                + "; ".join(self._descriptions(found))
            )
        raise ReadingQuestion(self._question(phrase.text, found))

    def _of_library(self, phrase: NounPhrase, found: list[int]) -> list[int]:
        """Choose objects of a library, others for other words: "the mug next to the red mug" are two."""
        words = _words(phrase).lower()
        if words not in self._chosen:
            fresh = [i for i in found if not any(i in taken for taken in self._chosen.values())]
            self._chosen[words] = tuple((fresh or found)[: phrase.mention.count])
        return list(self._chosen[words])

    def doubt(self, words: str, found: Sequence[int]) -> ReadingQuestion:
        """Return the question which of several objects some words mean."""
        return ReadingQuestion(self._question(words, found))

    def _question(self, words: str, found: Sequence[int]) -> Question:
        listed = self._descriptions(found)
        text = f"{words!r} can be each of {len(found)} objects: {'; '.join(listed)}; which one?"
        return Question(OBJECT, text, tuple(self.candidates.names[i] for i in found))

    def _descriptions(self, found: Sequence[int]) -> list[str]:
        return [self.candidates.description(i) for i in found]

    def _missing(self, phrase: NounPhrase) -> str:
        kinds = [] if self.catalogue else self._of_noun(phrase)[1]
        if kinds and (phrase.landmark is not None or phrase.ordinal is not None):
            return f"nothing here is {phrase.text!r}; of that kind there is: {'; '.join(self._descriptions(kinds))}"
        return self.candidates.missing(phrase.mention, "names")


def _left_out(phrase: NounPhrase, before: NounPhrase) -> tuple[str, ...]:
    """Return the adjectives that a phrase without a noun leaves out as well.

    What contrasts with the phrase before has its other adjectives: after "the leftmost red cup", "the rightmost one" is a
    red cup; after "the red cup", "the tall one" need not be red.
    """
    own, others = _classes(phrase), _classes(before)
    whole = phrase.other and not phrase.mention.modifiers and phrase.side is None
    if not (whole or own & others):
        return ()
    return tuple(word for word in before.mention.modifiers if _class_of(word) not in own and word not in SUPERLATIVES)


def _classes(phrase: NounPhrase) -> set[str]:
    found = {_class_of(word) for word in phrase.mention.modifiers} - {""}
    return found | ({"place"} if phrase.side is not None or phrase.ordinal is not None else set())


def _class_of(word: str) -> str:
    if is_color(word):
        return "colour"
    return "size" if word in SUPERLATIVES or word in COMPARATIVES or word in MEASURES else ""


def _indefinite(phrase: NounPhrase) -> bool:
    first = phrase.text.lower().split()[:3]
    if phrase.other and phrase.borrowed and not phrase.mention.definite:
        return True  # "one on the left and one on the right"
    return bool(first) and (first[0] in ("a", "an", "any", "some", "another") or first[:2] == ["one", "of"])


def _words(phrase: NounPhrase) -> str:
    words = phrase.text.split()
    while len(words) > 1 and words[0].lower() in ("the", "a", "an", "my", "all", "your", "our"):
        words = words[1:]
    return " ".join(words)
