"""Define the structure specification: the five slots that an instruction is read into.

Paper, section IV ("language") and appendix A.1: every token has a type and a value, and any
subset of the types may be given. A slot that was not requested stays `None`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from grounding.figures.figure import FigureError
from grounding.structure_words import STRUCTURES, is_shape, words_of

SHAPES = tuple(STRUCTURES)
# The shapes of the paper: those that the training language and the first networks have, and what an open shape becomes.
FIRST_SHAPES = SHAPES[:4]
SIZES = ("small", "medium", "large")
X_POSITIONS = ("left", "center", "right")
Y_POSITIONS = ("top", "middle", "bottom")
ROTATIONS = ("north", "east", "south", "west")

SLOTS = ("shape", "size", "x_position", "y_position", "rotation")
LEGAL_VALUES: Mapping[str, tuple[str, ...]] = {
    "shape": SHAPES,
    "size": SIZES,
    "x_position": X_POSITIONS,
    "y_position": Y_POSITIONS,
    "rotation": ROTATIONS,
}
# The values that the training language speaks of.
FIRST_VALUES: Mapping[str, tuple[str, ...]] = {**LEGAL_VALUES, "shape": FIRST_SHAPES}
# Which slots a shape can carry. Without a shape every slot is open: the builder chooses a shape
# that can carry them all.
SLOTS_OF_SHAPE: Mapping[str | None, tuple[str, ...]] = {
    **{shape: structure.slots for shape, structure in STRUCTURES.items()},
    None: SLOTS[1:],
}
_OPPOSITES = (
    ("left", "right"), ("top", "bottom"), ("north", "south"), ("east", "west"), ("near", "far"), ("away", "closer"),
    ("left of", "right of"), ("in front of", "behind"),
)  # fmt: skip
# Every word for a direction -> the one for the other direction.
OPPOSITE: Mapping[str, str] = {**dict(_OPPOSITES), **{other: one for one, other in _OPPOSITES}}


class SpecError(ValueError):
    """A slot or value that the vocabulary does not have; the message lists the legal ones."""


def slots_of(shape: str | None) -> tuple[str, ...]:
    """Return which slots a shape or figure can carry besides the shape; of an open shape, all.

    Raises:
        SpecError: for a name that has neither.
    """
    try:
        return SLOTS_OF_SHAPE[None] if shape is None else words_of(shape).slots
    except FigureError as error:
        raise SpecError(str(error)) from error


@dataclass(frozen=True)
class StructureSpec:
    """The structure to build; `None` means that the speaker left the slot open.

    Attributes:
        shape: one of `SHAPES`, or the name of a figure (`grounding.figures`).
        size: one of `SIZES`: how far the structure is spread out beyond its tightest extent.
        x_position: one of `X_POSITIONS`; left is +y of the world frame.
        y_position: one of `Y_POSITIONS`; top is far from the robot, +x of the world frame.
        rotation: one of `ROTATIONS`: the heading that the structure faces (north +x, west +y).

    Raises:
        SpecError: for a value outside the vocabulary, or a slot that the shape cannot carry.
    """

    shape: str | None = None
    size: str | None = None
    x_position: str | None = None
    y_position: str | None = None
    rotation: str | None = None

    def __post_init__(self) -> None:
        for slot in SLOTS:
            value = getattr(self, slot)
            figure = slot == "shape" and isinstance(value, str) and is_shape(value)
            if value is not None and not figure and value not in LEGAL_VALUES[slot]:
                also = "the name of a figure, " if slot == "shape" else ""
                raise SpecError(
                    f"{slot} cannot be {value!r}; legal values: {', '.join(LEGAL_VALUES[slot])}, {also}or None"
                )
        for slot in SLOTS[1:]:
            if getattr(self, slot) is not None and slot not in slots_of(self.shape):
                raise SpecError(
                    f"a {self.shape} has no {slot} (got {getattr(self, slot)!r}); "
                    f"its slots: {', '.join(slots_of(self.shape))}"
                )

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> StructureSpec:
        """Make the spec of a mapping slot -> value (missing slots are unspecified)."""
        unknown = sorted(set(values) - set(SLOTS))
        if unknown:
            raise SpecError(f"unknown slot {unknown[0]!r}; legal slots: {', '.join(SLOTS)}")
        return cls(**values)

    def to_dict(self) -> dict[str, str | None]:
        """Return slot -> value, `None` where unspecified, in the order of `SLOTS`."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def tokens(self) -> tuple[tuple[str, str], ...]:
        """List the specified (slot, value) pairs: the paper's word tokens."""
        return tuple((slot, value) for slot, value in self.to_dict().items() if value is not None)

    def turned(self) -> StructureSpec:
        """Turn positions and rotation by 180 degrees: the same goal, spoken from the opposite side."""
        return StructureSpec(
            self.shape,
            self.size,
            *(OPPOSITE.get(value or "", value) for value in (self.x_position, self.y_position, self.rotation)),
        )

    def __str__(self) -> str:
        return ", ".join(f"{slot} {value}" for slot, value in self.tokens()) or "nothing specified"
