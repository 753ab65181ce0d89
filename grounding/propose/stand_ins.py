"""Let a shape that the networks were not taught be read as one that they were: a new shape needs no training.

Its nouns are exchanged for those of the taught shape that takes the most alike slots and keys and that the text does not speak of;
the goal that is written gets the shape back.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from grounding.goal_network.vocabulary import TAUGHT_SHAPES
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.structure_words import STRUCTURES


@dataclass(frozen=True)
class StandIns:
    """The taught shapes that stand for new ones in one text.

    Attributes:
        shapes: new shape -> taught shape.
    """

    shapes: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, text: str, before: Goal = Goal()) -> StandIns:
        """Choose the stand-ins of a text and of the goal that it is about."""
        there = {part.shape for part in before.structures}
        spoken = {shape for shape, words in STRUCTURES.items() if shape in there or _nouns(shape).search(text)}
        shapes: dict[str, str] = {}
        for shape in sorted(spoken.difference(TAUGHT_SHAPES)):
            free = [one for one in TAUGHT_SHAPES if one not in spoken and one not in shapes.values()]
            shapes[shape] = min(free, key=partial(_difference, shape))
        return cls(shapes)

    def text(self, said: str) -> str:
        """Return a text with the nouns of the taught shapes."""
        for shape, taught in self.shapes.items():
            said = _nouns(shape).sub(STRUCTURES[taught].words.nouns[0], said)
        return said

    def goal(self, goal: Goal) -> Goal:
        """Return a goal with the taught shapes."""
        return Goal(tuple(
            replace(part, shape=self.shapes.get(part.shape or "", part.shape)) if isinstance(part, StructurePart) else part
            for part in goal.parts
        ))  # fmt: skip

    def parts(self, written: tuple[dict[str, Any], ...]) -> tuple[dict[str, Any], ...]:
        """Return the parts that the network wrote with the new shapes in their place."""
        back = {taught: shape for shape, taught in self.shapes.items()}
        return tuple(part | {"shape": back.get(part["shape"], part["shape"])} if "shape" in part else part for part in written)


def _difference(shape: str, taught: str) -> tuple[bool, int]:
    """Return how unlike two shapes are: whether one alone stands in layers, and how many slots and keys one alone takes."""
    one, other = STRUCTURES[shape], STRUCTURES[taught]
    return one.stacked != other.stacked, len({*one.slots, *one.keys} ^ {*other.slots, *other.keys})


def _nouns(shape: str) -> re.Pattern[str]:
    """Return the pattern of a shape's nouns, plurals included."""
    words = "|".join(sorted(map(re.escape, (shape, *STRUCTURES[shape].words.nouns)), key=len, reverse=True))
    return re.compile(rf"\b(?:{words})(?:e?s)?\b", re.IGNORECASE)
