"""Check whether an object stands as it was placed: near its predicted place, upright, and on what it was to rest on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from structdiffusion.evaluation_protocol import MAX_DISPLACEMENT, MAX_TILT
from structdiffusion.geometry import tilt_between
from structdiffusion.simulation.world import FALLEN, TABLE, TabletopWorld

_TOUCHING = 0.005  # m between the surfaces of two bodies that still counts as contact
_AS_HIGH = 0.02  # m from its predicted height: what is no farther off rests on something as high as its support


@dataclass(frozen=True)
class Standing:
    """How one object stands, against where it was to stand.

    Attributes:
        displacement: from its predicted place, in the plane, metres.
        tilt: from its predicted orientation, radians.
        on_table: whether it is still on the table at all.
        supported: whether it rests on what it was to rest on.
    """

    displacement: float
    tilt: float
    on_table: bool = True
    supported: bool = True

    @property
    def in_place(self) -> bool:
        """Return whether it is as near to its place as the protocol asks."""
        return self.on_table and self.displacement <= MAX_DISPLACEMENT

    @property
    def upright(self) -> bool:
        """Return whether it is tilted by no more than the protocol allows."""
        return self.tilt <= MAX_TILT

    @property
    def stands(self) -> bool:
        """Return whether it stands as placed."""
        return self.in_place and self.upright and self.supported

    def trouble(self, support: str = "what it was to stand on") -> str:
        """Say why it does not stand as placed, in words that follow its name; empty if it does."""
        if not self.on_table:
            return "has fallen off the table"
        words = []
        if not self.upright:
            words.append(f"lies {math.degrees(self.tilt):.0f} degrees off")
        if not self.in_place:
            words.append(f"is {100 * self.displacement:.1f} cm from its place")
        return " and ".join(words) or ("" if self.supported else f"does not rest on {support}")


def standing(world: TabletopWorld, index: int, world_from_goal: np.ndarray, support: int | None = None) -> Standing:
    """Return how an object stands now; physics does not run.

    Args:
        world: the world.
        index: of the object in the world.
        world_from_goal: (4, 4) where it was to stand.
        support: the object, or `TABLE`, that it was to rest on; `None` if that is not known.
    """
    pose = world.pose(index)
    supported = True
    if support is not None and abs(pose[2, 3] - world_from_goal[2, 3]) > _AS_HIGH:
        supported = world.clearances(index, _TOUCHING, [support]).get(support, math.inf) <= _TOUCHING
    displacement = float(np.linalg.norm(pose[:2, 3] - world_from_goal[:2, 3]))
    return Standing(displacement, tilt_between(pose, world_from_goal), bool(pose[2, 3] > FALLEN), supported)


def support_name(support: int | None, names: Sequence[str]) -> str:
    """Return what people call a support: "the table", or the name of an object; empty if it is not known."""
    if support is None:
        return ""
    return "the table" if support == TABLE else names[support]
