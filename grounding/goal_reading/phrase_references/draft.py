"""Collect what a copied phrase says while it is read."""

from __future__ import annotations

from dataclasses import dataclass, field

from grounding.goal_reading.phrase_references.phrase import Phrase, Rank, Test


@dataclass
class Draft:
    """A phrase that is being read; the fields are those of `Phrase`.

    Attributes:
        sides: where its objects stand, as adjectives say: "the far left cup".
        place: an ordinal that is not used yet: "second".
        used: whether the use of its objects was said before the noun: "writing tools".
    """

    kind: str = "objects"
    noun: tuple[str, ...] = ()
    borrowed: bool = False
    bare: bool = False
    plural: bool | None = None
    count: int | None = None
    every: bool = False
    definite: bool = True
    demonstrative: bool = False
    tests: list[tuple[Test, ...]] = field(default_factory=list)
    rank: Rank | None = None
    among: Phrase | None = None
    without: list[Phrase] = field(default_factory=list)
    other: bool = False
    sides: list[str] = field(default_factory=list)
    place: int | None = None
    used: bool = False
    open: bool = False

    def test(self, *alternatives: Test) -> None:
        """Add a test of which one alternative must hold."""
        self.tests.append(alternatives)

    @property
    def chooses(self) -> bool:
        """Return whether it says of its objects more than a number."""
        return bool(
            self.tests or self.sides or self.rank is not None or self.place or self.other or self.among is not None
        )

    def finished(self, text: str) -> Phrase:
        """Return the phrase."""
        tests = list(self.tests)
        rank = self.rank
        if self.place is not None and rank is None:
            rank = Rank(self.sides[0] if self.sides else "", self.place)
        elif self.sides:
            # "the nearest object on the right": both sides together, as one alone would leave a single object
            places = [each for each in tests if len(each) == 1 and each[0].kind == "place" and not each[0].negated]
            tests = [each for each in tests if each not in places]
            sides = (*self.sides, *(side for each in places for side in each[0].sides))
            tests.append((Test("place", sides=tuple(dict.fromkeys(sides))),))
        return Phrase(
            text, self.kind, self.noun, self.borrowed, self.bare, self.plural, self.count, self.every, self.definite,
            self.demonstrative, tuple(tests), rank, self.among, tuple(self.without), self.other, self.open,
        )  # fmt: skip
