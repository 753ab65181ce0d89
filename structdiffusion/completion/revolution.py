"""Bodies of revolution about an upright axis, built from a profile as convex parts."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from structdiffusion.completion.view import EDGE
from structdiffusion.objects.solids import frustum

_SIDES = 16  # pieces around a hollow object


@dataclass(frozen=True)
class Turned:
    """A body of revolution about an upright axis. World frame, metres.

    Attributes:
        middle: (2,) position of the axis.
        outer: (K, 2) radius and height of the seen outside, from the support up.
        inner: (L, 2) the same for the inside of a hollow object, from its floor up; empty for a solid one.
        ball: whether it is a ball that spans the heights of `outer`.
    """

    middle: np.ndarray
    outer: np.ndarray
    inner: np.ndarray
    ball: bool = False

    @property
    def hollow(self) -> bool:
        """Return whether the camera saw into it."""
        return len(self.inner) > 0

    def parts(self) -> tuple[np.ndarray, ...]:
        """Return the convex parts, each (V, 3)."""
        at = np.array([*self.middle, 0.0])
        if self.ball:
            low, high = self.outer[0, 1], self.outer[-1, 1]
            return (_ball((high - low) / 2) + at + [0.0, 0.0, (low + high) / 2],)
        if self.hollow:
            floor = self.inner[0, 1]
            below = self.outer[self.outer[:, 1] < floor - 5e-4]
            base = np.vstack((below, [np.interp(floor, self.outer[:, 1], self.outer[:, 0]), floor])) + [EDGE, 0.0]
            return tuple(part + at for part in (np.concatenate(_stack(base)), *self._walls()))
        pieces = _stack(self.outer)
        whole = np.concatenate(pieces)
        hull = ConvexHull(whole)
        if hull.volume < 1.04 * sum(ConvexHull(piece).volume for piece in pieces):
            pieces = [whole[hull.vertices]]
        return tuple(piece + at for piece in pieces)

    def _walls(self) -> list[np.ndarray]:
        """Return the wall in pieces (8, 3) that each span a part of the circle and of the height."""
        angles = np.arange(_SIDES + 1) * 2 * math.pi / _SIDES
        around = np.stack((np.cos(angles), np.sin(angles)), axis=1)
        heights = self.inner[:, 1]
        radii = (self.inner[:, 0], np.interp(heights, self.outer[:, 1], self.outer[:, 0]) + EDGE)
        rings = [_round_radius(ring, _SIDES) for ring in radii]
        corners = np.array([
            [np.column_stack((ring[k] * around, np.full(_SIDES + 1, z))) for ring in rings]
            for k, z in enumerate(heights)
        ])  # (L, inner and outer, around, 3)  # fmt: skip
        return [
            corners[k : k + 2, :, side : side + 2].reshape(-1, 3)
            for k in range(len(heights) - 1)
            for side in range(_SIDES)
        ]


def _stack(profile: np.ndarray) -> list[np.ndarray]:
    """Return truncated cones between the radii and heights (K, 2) of a profile."""
    grown = np.column_stack((_round_radius(profile[:, 0], 24), profile[:, 1])).tolist()
    return [frustum(a, b, low, high) for (a, low), (b, high) in itertools.pairwise(grown)]


def _round_radius(radius: np.ndarray, sides: int) -> np.ndarray:
    """Return the corner radius of a polygon that lies as much outside a circle as inside it."""
    return radius * (1 + 0.5 * (1 - math.cos(math.pi / sides)))


def _ball(radius: float) -> np.ndarray:
    """Return about 60 points (V, 3) spread evenly over a sphere, including its lowest and highest point."""
    count = 62
    z = np.linspace(1.0, -1.0, count)
    turn = math.pi * (1 + math.sqrt(5)) * np.arange(count)
    level = np.sqrt(np.maximum(0.0, 1 - z**2))
    return radius * np.stack((level * np.cos(turn), level * np.sin(turn), z), axis=1)
