"""Hold what the goal network reads in a text."""

from __future__ import annotations

from dataclasses import dataclass

from grounding.goals.goal import Goal
from grounding.goals.parts import RelationPart
from grounding.parse_result import Question

_FAR = frozenset("far away farther further farthest furthest".split())


@dataclass(frozen=True)
class NetworkReading:
    """The network's reading of an instruction.

    Attributes:
        goal: what was read, in the speaker's frame; `None` where nothing was, or it cannot be used.
        certainty: from 0 to 1.
        question: what has to be settled first, as which of two objects is meant.
        nouns: that chose the objects.
        described: whether more than nouns chose the objects.
        notes: remarks for the user.
        uncopied: words of the instruction that are in no phrase for objects or lengths.
        unknown: those of them that the network was not taught, or that no goal can hold.
        answer: what was written in place of a goal, a word of `NO_GOAL`; "" for a goal.
        others: less likely readings of a correction, the likeliest first; those of the same goal are added up in one.
    """

    goal: Goal | None = None
    certainty: float = 0.0
    question: Question | None = None
    nouns: tuple[str, ...] = ()
    described: bool = False
    notes: tuple[str, ...] = ()
    uncopied: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    answer: str = ""
    others: tuple[NetworkReading, ...] = ()


def brings_together(reading: NetworkReading) -> bool:
    """Return whether the network's goal puts something next to what the instruction wants it far from."""
    parts = () if reading.goal is None else reading.goal.parts
    relations = [part for part in parts if isinstance(part, RelationPart)]
    near = any(part.relation == "next to" and part.distance is None for part in relations)
    return near and "from" in reading.uncopied and not _FAR.isdisjoint(reading.uncopied)
