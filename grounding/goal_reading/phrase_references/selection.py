"""Choose the objects of a scene that a copied phrase describes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.phrase_references.adjectives import HUES, NEUTRAL, TEMPERATURES, colours_of, size_of
from grounding.goal_reading.phrase_references.choice_errors import Doubt, NothingFits
from grounding.goal_reading.phrase_references.likeness_choice import LikenessChoice
from grounding.goal_reading.phrase_references.phrase import Phrase, Rank, Test
from grounding.goal_reading.phrase_references.properties import property_of
from grounding.goal_reading.phrase_references.scene_nouns import SceneNouns
from grounding.goal_reading.phrase_references.size_choice import SizeChoice
from grounding.goal_reading.phrase_references.table_places import SIDES_OF_TABLE, TablePlaces
from grounding.goal_reading.scene_references import SceneReferences
from grounding.goal_reading.standing_places import PlaceError
from grounding.references.attributes import MEASURES, ObjectAttributes
from grounding.references.lexicon import KINDS
from grounding.references.phrases import ANY, Mention

# What is said of things without choosing between them: "the coffee mug", "the sticky tape".
_COMPOUNDS = frozenset(
    "coffee tea sticky felt tip felt-tip whiteboard drinking toy building cooking kitchen breakfast dinner soup "
    "cereal fruit "
    "table desk office garden picnic party team sellotape parcel cardboard storage plant flower clay china house "
    "mobile play".split()
)
_ORDER = tuple(
    "colour hue lonely kind use occasion property alike measure size more stands between place nearest equal odd contrast word".split()
)


class Selection:
    """A choice of objects in one scene.

    Args:
        find: the scene.
        nouns: of the scene.
        of_phrase: finds the objects of a phrase within another one.
        model: finds what "of the same colour" compares with, where no phrase says it.
    """

    def __init__(
        self,
        find: SceneReferences,
        nouns: SceneNouns,
        of_phrase: Callable[[Phrase], list[int]],
        model: Callable[[], list[int]],
    ) -> None:
        self.nouns, self._of_phrase, self.model = nouns, of_phrase, model
        self._attributes: list[ObjectAttributes | None] = [each.attributes for each in find.objects or ()]
        self._standing, self._sizes = find.places, SizeChoice(self._attributes)
        self.places = TablePlaces(find.places)
        self._likeness = LikenessChoice(self._attributes, nouns.head)

    def fitting(self, phrase: Phrase, base: Sequence[int]) -> list[int]:
        """Keep those of some objects that a phrase describes; the first ones where it chooses by order.

        Args:
            phrase: its noun is left aside.
            base: the objects of its noun.

        Raises:
            NothingFits: for words whose meaning is not known here, and for words of place where no place is known.
        """
        try:
            return self._fitting(phrase, list(base))
        except PlaceError as error:
            raise NothingFits(str(error)) from error

    def _fitting(self, phrase: Phrase, found: list[int]) -> list[int]:
        if phrase.among is not None:
            group = set(self._of_phrase(phrase.among))
            found = [i for i in found if i in group]
        unknown: list[str] = []
        for alternatives in sorted(phrase.tests, key=lambda each: _ORDER.index(each[0].kind)):
            if alternatives[0].kind == "word":
                found = self._worded(alternatives[0].word, found, unknown)
            else:
                found = self._tested(alternatives, found, phrase)
        if phrase.rank is not None:
            found = self._ranked(phrase, phrase.rank, found)
        if unknown and not self._agrees(phrase, found):
            raise NothingFits(f"it is not known which of the objects here are {unknown[0]!r}")
        return found

    def _agrees(self, phrase: Phrase, found: Sequence[int]) -> bool:
        """Return whether as many objects were found as a phrase speaks of."""
        if phrase.count is not None:
            return len(found) == phrase.count
        return not phrase.plural and len(found) == 1

    def _worded(self, word: str, found: list[int], unknown: list[str]) -> list[int]:
        holding = [i for i in found if self.nouns.says(i, word)]
        if not holding and word not in _COMPOUNDS:
            unknown.append(word)
        return holding or found

    def _tested(self, alternatives: Sequence[Test], found: list[int], phrase: Phrase) -> list[int]:
        kept: list[int] = []
        for test in alternatives:
            fits = self._one_test(test, found, phrase)
            if test.negated:
                fits = [i for i in found if i not in fits]
            kept += [i for i in fits if i not in kept]
        return [i for i in kept if i in found] if len(alternatives) == 1 else [i for i in found if i in kept]

    def _one_test(self, test: Test, found: list[int], phrase: Phrase) -> list[int]:
        many = bool(phrase.plural or phrase.every or test.negated) and phrase.count != 1
        if test.kind == "colour":
            return [i for i in found if self._coloured(i, test.word, found)]
        if test.kind == "hue":
            return self._of_hue(test.word, found)
        if test.kind == "lonely":
            return self._likeness.lonely(found, test.word)
        if test.kind == "odd":
            return self._likeness.odd(found)
        if test.kind == "equal":
            pair = test.word == "pair"
            return found if pair and len(found) == 2 else self._likeness.equal(found, test.word, phrase.count)
        if test.kind == "kind":
            group = self._of_kind(test)
            return [i for i in found if i in group]
        if test.kind == "use":
            kinds = tuple(test.word.split())
            return [i for i in found if i in self.nouns.of_kinds(kinds)]
        if test.kind == "occasion":
            return [i for i in found if i in (self.nouns.of_occasion(test.word) or ())]
        if test.kind == "property":
            return self._with_property(test.word, found, phrase, many)
        if test.kind == "size":
            return self._sizes.fitting(test, found, phrase.count, many)
        if test.kind == "measure":
            return [i for i in found if self._sizes.beyond(test, i)]
        if test.kind == "place":
            return self.places.choose(
                found, test.sides, many or phrase.rank is not None, None if phrase.rank else phrase.count
            )
        return self._related(test, found, phrase, many)

    # Colours and kinds

    def _colour(self, index: int) -> str:
        attributes = self._attributes[index]
        return attributes.colors[0] if attributes is not None and attributes.colors else ""

    def _coloured(self, index: int, word: str, among: Sequence[int]) -> bool:
        own, wanted = self._colour(index), colours_of(word) or ()
        if any(self._colour(i) == word for i in among):
            return own == word or self.nouns.says(index, word)
        if not own:
            return self.nouns.says(index, word)
        best = next((each for each in wanted if any(self._colour(i) == each for i in among)), "")
        return own == best or (own in wanted and not best)

    def _of_hue(self, word: str, found: list[int]) -> list[int]:
        """Keep what is coloured, or of a warm or cold colour."""
        colours = [self._colour(i) for i in found]
        judged = (*HUES["warm"], *HUES["cold"], *NEUTRAL) if word in TEMPERATURES else (*HUES["coloured"], *NEUTRAL)
        if not all(each in judged for each in colours):
            raise NothingFits(f"it is not known which of the objects here are {word!r}")
        return [i for i, colour in zip(found, colours, strict=True) if colour in HUES[word]]

    def _of_kind(self, test: Test) -> list[int]:
        assert test.other is not None  # what the objects are, or are not
        kind = replace(test.other, count=None, plural=True, every=True, definite=True)
        return self._of_phrase(kind)

    def of_same_colour(self, index: int, among: Sequence[int]) -> list[int]:
        """Keep the objects that have the colour of another one."""
        return [i for i in among if self._colour(i) and self._colour(i) == self._colour(index)]

    # Properties and sizes

    def _with_property(self, word: str, found: list[int], phrase: Phrase, many: bool) -> list[int]:
        """Keep the objects that surely have a property; those of a lower tier where the phrase speaks of them."""
        known = property_of(word)
        if known is None:
            raise NothingFits(f"it is not known which of the objects here are {word!r}")
        taken: list[int] = []
        for tier in known.tiers:
            taken += [i for i in self.nouns.of_kinds(tier) if i in found and i not in taken]
            if taken and (phrase.count is None or len(taken) >= phrase.count):
                break
        if not taken and (size := size_of(word)) is not None:
            return self._sizes.fitting(Test("size", size[0]), found, phrase.count, many)  # "the deep one"
        possible = self.nouns.of_kinds(known.open)
        doubtful = [
            i for i in found
            if i not in taken and (i in possible or (self.nouns.head(i) not in KINDS and not taken))
        ]  # fmt: skip
        if doubtful and not (taken and (not many or len(taken) == phrase.count)):
            raise NothingFits(f"it is not known which of the objects here are {word!r}")
        return taken

    def _ranked(self, phrase: Phrase, rank: Rank, found: list[int]) -> list[int]:
        """Choose by order: by size, from a side of the table, or as they are numbered."""
        count = phrase.count or 1
        if rank.by in MEASURES:
            return self._sizes.ranked(rank, found, count)
        ranked = sorted(found, key=self.places.along(rank.by)) if rank.by in SIDES_OF_TABLE else found
        first = rank.place - 1 if rank.place > 0 else len(ranked) - 1
        return ranked[first : first + count]

    # Other objects

    def _related(self, test: Test, found: list[int], phrase: Phrase, many: bool) -> list[int]:
        if test.kind == "alike":
            models = self._of_phrase(test.other) if test.other is not None else self.model()
            colours = {self._colour(i) for i in models} - {""}
            if not colours:
                raise NothingFits("it is not clear which colour is meant")
            return [i for i in found if self._colour(i) in colours and i not in models]
        if test.other is None:  # "the one that is" contrasts with what another phrase says, which is not known here
            raise NothingFits(f"it is not clear which of the objects here {phrase.text!r} means")
        landmark = self._of_phrase(test.other)
        if test.kind == "between":
            amid = test.word != "and"
            return self._amid(found, phrase, landmark) if amid else [i for i in found if i not in landmark]
        if test.kind == "stands" and test.word == "between" and len(landmark) == 2:
            return self.places.between(found, landmark[0], landmark[1])[: phrase.count or (None if many else 1)]
        relation = test.word
        if test.kind != "stands":
            nearest = "nearest" if test.word == "near" else "farthest"
            relation = nearest if test.kind == "nearest" else f"{test.word} than"
        mention = Mention(ANY, (), phrase.count or (None if many else 1), False, "target", True, many, (), None, (0, 0))
        asked = NounPhrase("objects", 0, 0, phrase.text, mention, relation=relation)
        return self._standing.beside(asked, found, landmark)

    def _amid(self, found: list[int], phrase: Phrase, landmark: list[int]) -> list[int]:
        seconds = [each[0].other for each in phrase.tests if each[0].kind == "between" and each[0].word == "and"]
        second = seconds[0] if seconds else None
        if second is None:
            raise NothingFits(f"it is not clear between what {phrase.text!r} is")
        other = self._of_phrase(second)
        if len(landmark) != 1 or len(other) != 1:
            raise Doubt(landmark + other)
        between = self.places.between(found, landmark[0], other[0])
        return between if phrase.plural else between[:1]
