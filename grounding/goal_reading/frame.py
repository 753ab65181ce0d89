"""Define frames: one for each thing that an instruction asks for, with all that is said of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from grounding.goal_reading.noun_phrase import NounPhrase

# Chunks that say something of objects.
PREDICATES = frozenset((
    "shape", "place", "along", "rotation", "relation", "order", "order end", "direction", "listed", "gap", "radius", "diameter",
    "length of", "grid", "rows", "columns", "group", "move", "move?", "relation?", "size", "together", "side by side", "stacked",
    "beside each other", "around", "inner", "away", "relation it", "wide", "table setting", "apart", "length", "another",
    "either side", "same distance", "one side", "groups", "each alone", "rank",
))  # fmt: skip

# Those that say how objects stand to others.
RELATIONAL = ("relation", "apart", "relation it", "either side")

# Those that say where objects stand, and not in which shape.
PLACING = ("place", "along", "inner", "relation", "relation it", "apart")


@dataclass(frozen=True)
class Predicate:
    """What is said of objects: a chunk, with the noun phrases that belong to it."""

    kind: str
    value: Any
    said: str
    first: int
    end: int
    metres: float | None = None
    reference: tuple[NounPhrase, ...] = ()


@dataclass
class Frame:
    """One thing that is asked for.

    Attributes:
        verb: the kind of its verb, or "".
        verb_said: the verb as it was written.
        objects: the noun phrases that it is about.
        predicates: what is said of them.
        second: objects that it is done with: those that the first are swapped with, or that surround them.
        listed: whether the objects were named one after another ("first the mug, then the bowl").
        sentence: in which sentence it stands.
        first, end: its words.
        negated: whether it says what must not be done.
        stays: whether it says what stays where it is.
        also: whether it says "too".
        same: whether it says "the same": what it leaves out is as in the frame before.
        respectively: whether its values belong to its objects one by one.
    """

    verb: str = ""
    verb_said: str = ""
    objects: list[NounPhrase] = field(default_factory=list)
    predicates: list[Predicate] = field(default_factory=list)
    second: list[NounPhrase] = field(default_factory=list)
    listed: bool = False
    sentence: int = 0
    first: int = 0
    end: int = 0
    negated: bool = False
    stays: bool = False
    also: bool = False
    same: bool = False
    respectively: bool = False

    def has(self, *kinds: str) -> bool:
        """Return whether something of these kinds is said."""
        return any(each.kind in kinds for each in self.predicates)

    def get(self, kind: str) -> list[Predicate]:
        """Return what is said of one kind."""
        return [each for each in self.predicates if each.kind == kind]

    @property
    def empty(self) -> bool:
        """Return whether nothing is said in it yet."""
        return not (self.objects or self.predicates or self.verb)
