"""Define the result of perception: a table, and the objects on it, each with a display name until the user names
it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from agent.perception.seen_colors import ColorName
from structdiffusion.observation import Table

EITHER = " or "  # between the two nouns of an object that is one of both
NOTHING, TABLE, ARM = -1, 0, -2  # in `Segments.labels`; object k of the list has the label k + 1


@dataclass(frozen=True)
class Segment:
    """One object as it was found.

    Attributes:
        name: "object 3", unique; numbered from the robot's side, from left to right.
        display_name: its name in instructions: "object 3, red, tall".
        points: (P, 3) float32, world frame, metres; every measured point of it.
        colors: (P, 3) uint8 RGB, or `None`.
        world_from_box: (4, 4) its oriented box: z up, x along the longer side, the origin in the middle.
        sides: (3,) of that box, metres.
        rests_on: the name of the object that it stands on or in; empty for the table.
        bottom: metres above the table at which it stands.
        support_seen: whether what it stands on was seen to carry it; else it seems to.
        color_names: the name of its colour, and a second one where it is in doubt; empty without colours.
        noun: what it is taken for, such as "mug", or "cup or mug"; empty where the picture does not tell.
        nouns: noun -> confidence that it is one, the highest first; empty if no noun was looked for.
    """

    name: str
    display_name: str
    points: np.ndarray
    colors: np.ndarray | None
    world_from_box: np.ndarray
    sides: np.ndarray
    rests_on: str = ""
    bottom: float = 0.0
    color_names: tuple[ColorName, ...] = ()
    noun: str = ""
    nouns: Mapping[str, float] = field(default_factory=dict)
    support_seen: bool = True

    @property
    def confidence(self) -> float | None:
        """Return the confidence in its noun, or in its two nouns together; `None` if it has none."""
        return sum(self.nouns[noun] for noun in self.noun.split(EITHER)) if self.noun else None


@dataclass(frozen=True)
class Segments:
    """A table and its objects in the world frame: z = 0 is the table's surface, x points away from the robot.

    Attributes:
        objects: in the order of their numbers.
        table: the rectangle that structures are built on: the part of the visible surface that the arm reaches.
        surface: the rectangle of the whole surface that was seen; it holds `table`, and every object.
        world_from_camera: (4, 4).
        world_from_base: (4, 4) where the arm's `link_base` stands.
        labels: (H, W) int16 for every pixel of the frame: `NOTHING`, `TABLE`, `ARM`, or 1 + the object's place.
        notes: what was assumed about frames, table and objects, each a sentence for the report.
    """

    objects: tuple[Segment, ...]
    table: Table
    surface: Table
    world_from_camera: np.ndarray
    world_from_base: np.ndarray
    labels: np.ndarray
    notes: tuple[str, ...] = ()
