"""Define what a copied noun phrase says: its noun, what its objects must fulfil, and how they are chosen."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Test:
    """One thing that the objects of a phrase must fulfil.

    Attributes:
        kind: "colour", "size", "property", "use", "place", "stands", "nearest", "more", "measure", "alike", "noun",
            "lonely" (nothing is like it), "odd", "equal" (there are others like it), "hue", "contrast" (what an earlier
            phrase says, or does not) or "word" (an adjective that nothing here knows).
        word: the colour, the adjective, the relation and so on.
        sides: for "place": where the objects stand, of "left", "right", "near", "far" and "middle".
        value: for "measure": metres.
        other: the phrase for objects that these are compared with.
        negated: whether the objects must not fulfil it.
    """

    kind: str
    word: str = ""
    sides: tuple[str, ...] = ()
    value: float = 0.0
    other: Phrase | None = None
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
        kind: "objects"; "all" of what there is; "rest", what no other phrase names; "pronoun"; "twin", what is of the
            kind of the object that was named before.
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
