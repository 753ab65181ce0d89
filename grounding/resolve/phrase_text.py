"""Hold the words of a copied phrase, and say of single words what they can be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from grounding.resolve.adjectives import colours_of
from grounding.resolve.lexicon import FILLINGS, FRUIT, GENERAL
from grounding.resolve.measures import COUNTS
from grounding.resolve.phrase import Phrase, Test
from grounding.resolve.referents import Referents
from grounding.resolve.word_forms import singular

# Words that no adjective stands before.
JOINTS = frozenset("and or , of with in on at to that which for is are the not non but ( ) than from".split())
_TARGETS = frozenset("to from me us away him her".split())


@dataclass(frozen=True)
class PhraseText:
    """The words of a copied phrase.

    Attributes:
        words: as `plain_words` divides it.
        there: what is there.
    """

    words: tuple[str, ...]
    there: Referents

    def word(self, place: int) -> str:
        """Return the word at a place; empty before the first and after the last."""
        return self.words[place] if 0 <= place < len(self.words) else ""

    def noun_at(self, place: int) -> bool:
        """Tell whether a noun stands at a place, or "thing" or "one"."""
        word = self.word(place)
        return bool(word) and (self.there.is_noun(word) or word in GENERAL or word in ("one", "ones"))

    def here(self, place: int) -> bool:
        """Tell whether a noun of something here stands at a place."""
        return bool(self.there.of_kinds((singular(self.word(place)),)))

    def colours_at(self, place: int) -> tuple[tuple[Test, ...], int] | None:
        """Read colours, "red and blue"; "the lemon" is fruit, and "an orange" where there is one.

        Returns:
            A test for each colour, and the place after them; `None` where none stands.
        """
        found: list[Test] = []
        end = place
        while True:
            word = self.word(end)
            alone = not self.noun_at(end + 1)
            edible = (word in FRUIT and word != "orange") or (word in FILLINGS and self.there.filling(word))
            fruit = alone and (bool(self.there.of_kinds((word,))) or edible)
            if colours_of(word) is None or fruit:
                break
            found.append(Test("colour", word))
            end += 1
            joint = end
            while self.word(joint) in ("and", "or", ",", "coloured"):
                joint += 1
            if joint == end or colours_of(self.word(joint)) is None:
                break
            end = joint
        return (tuple(found), end) if found else None

    def in_clause(self, place: int) -> bool:
        """Tell whether a word for a side belongs to a clause: "near me", "left of the plate"."""
        word, following = self.word(place), self.word(place + 1)
        if following == "of":
            rim = word in ("left", "right", "top", "bottom", "front", "middle", "back")
            target = self.word(place + 2) in ("middle", "the", "it", "this", "that", "my")
            noun = place + 3 + (self.word(place + 3) in COUNTS)
            return rim and target and not self.there.plural(self.word(noun))
        near = word in ("nearest", "closest", "furthest", "near", "close")
        return following in _TARGETS or (near and following in ("on", "in", "at", "the", "by"))


class PhraseReader(Protocol):
    """What the readers of clauses need: the words of a phrase, and a reader of the phrases within it."""

    text: PhraseText

    @property
    def words(self) -> tuple[str, ...]:
        """Return all words."""

    def word(self, place: int) -> str:
        """Return the word at a place; empty after the last."""

    def at(self, place: int, excepting: bool = True) -> tuple[Phrase, int] | None:
        """Read the phrase that begins at a place; return it and the place after it, or `None`."""
