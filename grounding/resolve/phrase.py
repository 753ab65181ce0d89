"""Define what a copied noun phrase says: its noun, what its objects must fulfil, and how they are chosen."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Test:
    """One thing that the objects of a phrase must fulfil.

    Attributes:
        kind: "colour", "size", "property", "use", "place", "stands", "nearest", "more", "measure", "kind",
            "number" (of "cup 2") or "word" (an adjective that nothing here knows).
        word: the colour, the adjective, the relation and so on.
        sides: for "place": where the objects stand, of "left", "right", "near", "far" and "middle".
        value: for "measure": metres.
        other: the phrase for objects that these are compared with.
        second: for "between": the phrase after "and".
        negated: whether the objects must not fulfil it.
    """

    kind: str
    word: str = ""
    sides: tuple[str, ...] = ()
    value: float = 0.0
    other: Phrase | None = None
    second: Phrase | None = None
    negated: bool = False


@dataclass(frozen=True)
class Rank:
    """A choice by order: "the second tallest", "the third from the left".

    Attributes:
        by: an adjective of size, or a side of the table.
        place: counted from 1; -1 for the last.
    """

    by: str
    place: int = 1


@dataclass(frozen=True)
class Phrase:
    """One noun phrase for objects.

    Attributes:
        text: as it was copied.
        kind: "objects"; "all" of what there is; "rest", what no other phrase names; "pronoun"; "known";
            "unread", which is not understood.
        noun: its words; empty for "one", "things" and bare adjectives.
        borrowed: whether a noun of other phrases may be meant, as for "the red one" and "the reds".
        bare: whether it has no word for a noun at all: "the red", "blue".
        plural: whether it speaks of several; `None` where the words leave it open.
        count: the number that it speaks of.
        every: whether all are meant that fit: "all", "both", "every".
        definite: whether it has no word such as "a" or "any".
        demonstrative: whether it points at what was named before: "that can".
        tests: what the objects must fulfil: one of the alternatives of each.
        rank: how they are chosen by order.
        among: the group that they are part of.
        without: what is left out.
        other: whether objects that other phrases name are left out.
        open: whether it speaks of one or several alike: "whatever is red".
        half: whether half of its objects are meant.
        objects: of a known phrase.
    """

    text: str
    kind: str = "objects"
    noun: tuple[str, ...] = ()
    borrowed: bool = False
    bare: bool = False
    plural: bool | None = None
    count: int | None = None
    every: bool = False
    definite: bool = True
    demonstrative: bool = False
    tests: tuple[tuple[Test, ...], ...] = ()
    rank: Rank | None = None
    among: Phrase | None = None
    without: tuple[Phrase, ...] = ()
    other: bool = False
    open: bool = False
    half: bool = False
    objects: tuple[int, ...] = ()

    @property
    def number_alone(self) -> bool:
        """Return whether it says no more than a number: "nine"."""
        return self.bare and self.count is not None and not (self.tests or self.rank or self.among or self.every)


@dataclass(frozen=True)
class PhraseGroup:
    """The phrases for the objects of one place of a goal.

    Attributes:
        texts: as they were copied.
        role: "structure", which is made of the objects; "objects" of a relation; its "reference"; "around", what stands
            within a structure; or "kept".
        shaped: whether a structure has a shape, which one object cannot have.
        part: the number of the part of the goal; -1 where it is not known.
    """

    texts: tuple[str, ...]
    role: str = "objects"
    shaped: bool = False
    part: int = -1


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
    half: bool = False

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
            from_side = next((each for each in tests if not self.sides and _one_side(each)), None)
            tests = [each for each in tests if each is not from_side]  # "the second mug from the left"
            sides = self.sides or (from_side[0].sides if from_side else ())
            rank = Rank(sides[0] if sides else "", self.place)
        elif self.sides:
            # "the nearest object on the right": both sides together, as one alone would leave a single object
            places = [each for each in tests if len(each) == 1 and each[0].kind == "place" and not each[0].negated]
            tests = [each for each in tests if each not in places]
            sides = (*self.sides, *(side for each in places for side in each[0].sides))
            tests.append((Test("place", sides=tuple(dict.fromkeys(sides))),))
        return Phrase(
            text, self.kind, self.noun, self.borrowed, self.bare, self.plural, self.count, self.every, self.definite,
            self.demonstrative, tuple(tests), rank, self.among, tuple(self.without), self.other, self.open, self.half,
        )  # fmt: skip


def _one_side(alternatives: tuple[Test, ...]) -> bool:
    first = alternatives[0]
    return first.kind == "place" and len(first.sides) == 1 and not first.negated


@dataclass
class SaidPhrase:
    """One phrase of a goal.

    Attributes:
        phrase: what it says.
        group: the number of its group.
        place: where the instruction says it.
        kept: whether its objects are to stay.
        found: its objects; `None` until they are found.
        part: the number of its part of the goal; -1 where it is not known.
        role: of its group.
        source: the words that were copied.
        inner: the objects of phrases within it, "of the same colour as the far cup".
    """

    phrase: Phrase
    group: int
    place: int
    kept: bool = False
    found: list[int] | None = None
    part: int = -1
    role: str = ""
    source: str = ""
    inner: list[list[int]] = field(default_factory=list)


class SaidPhrases:
    """All phrases of one goal, of which one is being resolved.

    Attributes:
        all: the phrases, as the goal has them.
        current: the one whose objects are looked for.
    """

    def __init__(self) -> None:
        self.all: list[SaidPhrase] = []
        self.current: SaidPhrase | None = None

    def of_group(self, number: int) -> list[SaidPhrase]:
        """List the phrases of a group."""
        return [each for each in self.all if each.group == number]

    def beside_current(self) -> list[Phrase]:
        """List the phrases of the group of the current one, itself among them."""
        return [each.phrase for each in self.of_group(self.current.group)] if self.current is not None else []

    def in_part(self, other: SaidPhrase) -> bool:
        """Tell whether another phrase stands beside the current one in a part: "the mug left of it" is not the mug."""
        current = self.current
        return current is not None and other.part == current.part >= 0 and other.group != current.group

    def beside_in_part(self) -> set[int]:
        """Return the objects of the other places of the current phrase's part, which it cannot mean as well."""
        return {i for each in self.all if self.in_part(each) for i in each.found or ()}

    def before(self) -> list[SaidPhrase]:
        """List the phrases that were said before the current one, and whose objects are known."""
        place = self.current.place if self.current is not None else 0
        known = (each for each in self.all if each.found is not None and each is not self.current)
        return sorted((each for each in known if each.place < place), key=lambda each: each.place)

    def mentioned(self) -> list[list[int]]:
        """List what was named before the current phrase, also within other phrases; the last one last."""
        own = self.current.inner if self.current is not None else []
        return [*(found for each in self.before() for found in (*each.inner, each.found or [])), *own[:-1]]

    def named(self) -> set[int]:
        """Return the objects that other phrases name; "everything" and pronouns name none."""
        return {
            i for each in self.all
            if each is not self.current and each.found is not None and each.phrase.kind not in ("all", "pronoun")
            for i in each.found
        }  # fmt: skip

    def again(self) -> list[int]:
        """Return the objects of the current phrase where it stands in a goal more often than it is said."""
        now = self.current
        same = (
            each.found
            for each in self.all
            if each is not now and now and (each.source, each.place) == (now.source, now.place)
        )
        return list(next(filter(None, same), ()))

    def kept(self) -> set[int]:
        """Return the objects that are to stay as they are, or that are left out."""
        return {i for each in self.all if each.kept and each is not self.current for i in each.found or ()}

    def alone(self) -> bool:
        """Tell whether no other group but what is to stay was found to mean something."""
        group = self.current.group if self.current is not None else -1
        return not any(each.group != group and each.found and not each.kept for each in self.all)
