"""Choose the objects of a scene that a phrase describes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from rapidfuzz import process
from rapidfuzz.distance import OSA

from grounding.resolve.adjectives import COLOURFUL, NEUTRAL, colours_of, property_of, size_of
from grounding.resolve.attributes import MEASURES
from grounding.resolve.errors import ResolveError, UnjudgedError
from grounding.resolve.lexicon import COLOURS, KINDS, MASS_NOUNS
from grounding.resolve.phrase import Phrase, Rank, Test
from grounding.resolve.referents import Referents
from grounding.resolve.size_choice import SizeChoice
from grounding.resolve.table_places import SIDES_OF_TABLE

# What is said of things without choosing between them: "the coffee mug", "the sticky tape".
_COMPOUNDS = frozenset(
    "coffee tea sticky felt tip felt-tip whiteboard drinking toy building cooking kitchen breakfast dinner soup cereal "
    "fruit table desk office garden picnic party team sellotape parcel cardboard storage plant flower clay china house "
    "mobile play".split()
)
_ORDER = tuple("number colour kind use occasion property measure size more stands place nearest word".split())


class Choice:
    """A choice of objects in one scene.

    Args:
        there: what is there.
        of_phrase: finds the objects of a phrase within another one.

    Attributes:
        notes: remarks on choices, a sentence each.
    """

    def __init__(self, there: Referents, of_phrase: Callable[[Phrase], list[int]]) -> None:
        self.there, self._of_phrase = there, of_phrase
        self.notes: list[str] = []
        self._sizes = SizeChoice(there.attributes)

    def fitting(self, phrase: Phrase, base: Sequence[int]) -> list[int]:
        """Keep those of some objects that a phrase describes; the first ones where it chooses by order.

        Args:
            phrase: its noun is left aside.
            base: the objects of its noun.

        Raises:
            ResolveError: for words whose meaning is not known here, and for words of place where no place is known.
        """
        found = list(base)
        if phrase.among is not None:
            group = set(self._of_phrase(phrase.among))
            found = [i for i in found if i in group]
        unknown: list[str] = []
        for alternatives in sorted(phrase.tests, key=lambda each: _ORDER.index(each[0].kind)):
            if alternatives[0].kind == "word":
                found = self._worded(alternatives[0].word, found, unknown)
            else:
                try:
                    found = self._tested(alternatives, found, phrase)
                except UnjudgedError as error:
                    unknown.append(error.word)
        if phrase.rank is not None:
            found = self._ranked(phrase, phrase.rank, found)
        if unknown and found and not self._agrees(phrase, found):
            problem = UnjudgedError(unknown[0])
            nearest = process.extractOne(unknown[0], COLOURS, scorer=OSA.distance, score_cutoff=1)
            mistyped = nearest is not None and nearest[0] != unknown[0]  # "bleu cups"
            if mistyped or not phrase.noun or not phrase.plural or phrase.count is not None:
                raise problem
            self.notes.append(f"{problem}: that word was ignored")
        return found

    def _agrees(self, phrase: Phrase, found: Sequence[int]) -> bool:
        """Return whether as many objects were found as a phrase speaks of."""
        if phrase.count is not None:
            return len(found) == phrase.count
        return not phrase.plural and len(found) == 1

    def _worded(self, word: str, found: list[int], unknown: list[str]) -> list[int]:
        holding = [i for i in found if self.there.says(i, word)]
        if not holding and word not in _COMPOUNDS:
            unknown.append(word)
        return holding or found

    def _tested(self, alternatives: Sequence[Test], found: list[int], phrase: Phrase) -> list[int]:
        kept: list[int] = []
        for test in alternatives:
            fits = self._one_test(test, found, phrase)
            if test.negated and test.kind == "size" and len(found) < 2:
                fits = []  # nothing is there to compare it with
            if test.negated:
                fits = [i for i in found if i not in fits]
            kept += [i for i in fits if i not in kept]
        return [i for i in kept if i in found] if len(alternatives) == 1 else [i for i in found if i in kept]

    def _one_test(self, test: Test, found: list[int], phrase: Phrase) -> list[int]:
        many = bool(phrase.plural or phrase.every or test.negated) and phrase.count != 1
        if test.kind == "colour":
            if found and not any(self.there.colour(i) or self.there.says(i, test.word) for i in found):
                raise UnjudgedError(test.word)
            return [i for i in found if self._coloured(i, test.word, found)]
        if test.kind == "kind":
            group = self._of_kind(test)
            return [i for i in found if i in group]
        if test.kind == "use":
            kinds = tuple(test.word.split())
            return [i for i in found if i in self.there.of_kinds(kinds)]
        if test.kind == "occasion":
            return [i for i in found if i in (self.there.of_occasion(test.word) or ())]
        if test.kind == "property":
            return self._with_property(test.word, found, phrase, many)
        if test.kind == "size":
            told = [i for i in found if self.there.says(i, test.word) and self.there.attributes[i] is None]
            return told or self._sizes.fitting(test, found, phrase.count, many)  # "object 3, red, tall"
        if test.kind == "measure":
            return [i for i in found if self._sizes.beyond(test, i)]
        if test.kind == "number":
            return self._numbered(int(test.word), found)
        if test.kind == "place":
            return self.there.places.choose(
                found, test.sides, many or phrase.rank is not None, None if phrase.rank else phrase.count
            )
        return self._related(test, found, phrase, many)

    def _numbered(self, number: int, found: list[int]) -> list[int]:
        """Keep "cup 2": by the numbers of the names, where they have some, else as they are listed."""
        if len(found) == 1 or any(self.there.number(i) is not None for i in found):
            return [i for i in found if (self.there.number(i) or 1) == number]
        return [number - 1] if number - 1 in found and len(found) == self.there.count else []

    # Colours and kinds

    def _coloured(self, index: int, word: str, among: Sequence[int]) -> bool:
        own, wanted = self.there.colour(index), colours_of(word) or ()
        if any(self.there.colour(i) == word for i in among):
            return own == word or self.there.says(index, word)
        if not own:
            return self.there.says(index, word)
        best = next((each for each in wanted if any(self.there.colour(i) == each for i in among)), "")
        return own == best or (own in wanted and not best)

    def _of_kind(self, test: Test) -> list[int]:
        assert test.other is not None  # what the objects are, or are not
        kind = replace(test.other, count=None, plural=True, every=True, definite=True)
        return self._of_phrase(kind)

    # Properties and sizes

    def _with_property(self, word: str, found: list[int], phrase: Phrase, many: bool) -> list[int]:
        """Keep the objects that surely have a property; those of a lower tier where the phrase speaks of them."""
        if told := [i for i in found if self.there.says(i, word)]:
            return told  # "object 1, green, flat"
        known = property_of(word)
        if known is None and word in COLOURFUL and all(self.there.colour(i) for i in found):
            return [i for i in found if self.there.colour(i) not in NEUTRAL]
        if known is None:
            raise UnjudgedError(word)
        taken: list[int] = []
        for tier in known.tiers:
            taken += [i for i in self.there.of_kinds(tier) if i in found and i not in taken]
            if taken and (phrase.count is None or len(taken) >= phrase.count):
                break
        if not taken and (size := size_of(word)) is not None:
            return self._sizes.fitting(Test("size", size[0]), found, phrase.count, many)  # "the deep one"
        possible = self.there.of_kinds(known.open)
        doubtful = [
            i for i in found
            if i not in taken and (i in possible or (self.there.head(i) not in KINDS and not taken))
        ]  # fmt: skip
        if doubtful and not (taken and (not many or len(taken) == phrase.count)):
            raise UnjudgedError(word)
        return taken

    def _ranked(self, phrase: Phrase, rank: Rank, found: list[int]) -> list[int]:
        """Choose by order: by size, from a side of the table, or as they are numbered."""
        count = phrase.count or 1
        if rank.by in MEASURES:
            return self._sizes.ranked(rank, found, count)
        ranked = sorted(found, key=self.there.places.along(rank.by)) if rank.by in SIDES_OF_TABLE else found
        first = rank.place - 1 if rank.place > 0 else len(ranked) - 1
        return ranked[first : first + count]

    # Other objects

    def _related(self, test: Test, found: list[int], phrase: Phrase, many: bool) -> list[int]:
        assert test.other is not None  # what they stand by, or are compared with
        landmark = self._of_phrase(test.other)
        if test.second is not None:
            landmark = [*landmark, *self._of_phrase(test.second)]
        if test.word == "between":
            if len(landmark) != 2:
                raise ResolveError(f"it is not clear between what {phrase.text!r} is")
            return self.there.places.between(found, landmark[0], landmark[1])[: phrase.count or (None if many else 1)]
        if test.kind == "nearest":
            return self.there.places.nearest(found, landmark, test.word == "far", phrase.count or (None if many else 1))
        if test.kind == "more":
            others = [i for i in found if i not in landmark]
            return [i for i in others if all(self._sizes.more(test.word, i, j) for j in landmark)]
        one_or_more = bool(phrase.noun) and phrase.noun[-1] in MASS_NOUNS  # "the fruit behind the orange"
        return self.there.places.beside(found, test.word, landmark, many and not one_or_more)
