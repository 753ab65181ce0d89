"""Objects as structures see them: layout items before a layout, and placed bodies afterwards."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from structdiffusion.geometry import wrap_angle

# Length over width of an outline, above which an object has a long axis that layouts turn.
_ELONGATED = 1.6


class ObjectTraits(Protocol):
    """The properties that decide whether an object suits a structure; see `structdiffusion.objects.model.ObjectModel`.

    Attributes:
        category: its noun.
        radius: of its footprint, metres.
        height: metres.
        stackable: whether something can stand on it.
        flat_bottom: whether it can stand on something.
    """

    @property
    def category(self) -> str: ...
    @property
    def radius(self) -> float: ...
    @property
    def height(self) -> float: ...
    @property
    def stackable(self) -> bool: ...
    @property
    def flat_bottom(self) -> bool: ...


@dataclass(frozen=True)
class LayoutItem:
    """The properties of an object, as it stands now, that a layout needs.

    Attributes:
        category: its noun.
        footprint: (K, 2) convex outline about the footprint's centroid, turned as it stands in the world, metres.
        height: metres.
        front_yaw: the world heading of its front as it stands, radians.
        stackable: whether something can stand on it.
        flat_bottom: whether it can stand on something.
    """

    category: str
    footprint: np.ndarray
    height: float
    front_yaw: float = 0.0
    stackable: bool = True
    flat_bottom: bool = True

    def turn_to_axis(self, axis_yaw: float) -> float:
        """Return the turn (rad) that brings its long axis to `axis_yaw` the short way round; 0 for a compact object."""
        centred = self.footprint - self.footprint.mean(axis=0)
        values, vectors = np.linalg.eigh(centred.T @ centred)
        long_axis = vectors[:, 1]
        shadows = self.footprint @ vectors
        width, length = np.ptp(shadows, axis=0)
        if length < _ELONGATED * width or values[1] <= 0:
            return 0.0
        turn = wrap_angle(axis_yaw - math.atan2(long_axis[1], long_axis[0]))
        return turn - math.copysign(math.pi, turn) if abs(turn) > math.pi / 2 else turn


@dataclass(frozen=True)
class PlacedBody:
    """One object of a finished structure, in the world frame, metres.

    Attributes:
        name: what reports call it.
        category: its noun.
        footprint: (K, 2) convex outline, counter-clockwise.
        centroid: (2,) the footprint's area centroid.
        z_bottom: its lowest z.
        z_top: its highest z.
        front_yaw: the heading of its front (+x of the object frame).
        rests_on: indices of the bodies that carry it; () is the table.
    """

    name: str
    category: str
    footprint: np.ndarray
    centroid: np.ndarray
    z_bottom: float
    z_top: float
    front_yaw: float
    rests_on: tuple[int, ...] = ()

    @property
    def local_footprint(self) -> np.ndarray:
        """Return the outline (K, 2) about the centroid."""
        return self.footprint - self.centroid
