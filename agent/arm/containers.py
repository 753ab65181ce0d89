"""Describe open containers to the motion planner: their walls, which leave the inside free."""

from __future__ import annotations

import math

import numpy as np

from agent.arm.motion_planner import solid_hull

WALLS = 12  # sectors around a container's middle, each with one piece of its wall
_RIM_DEPTH = 0.015  # m below the highest points of a container, where its rim is seen
_THINNEST = 0.003  # m: a wall of which only one side is seen
_FEWEST_POINTS = 8  # in a sector; where fewer are seen, the wall is taken to be as far out as elsewhere


def walls_of(cloud: np.ndarray, support: float = 0.0) -> list[np.ndarray]:
    """Return the walls of an open container as vertices (V, 3) of convex pieces, at most `WALLS` of them.

    The rim is what the camera sees best; the walls are taken to be as thick as it all the way down.

    Args:
        cloud: (P, 3) what was seen of the container, world frame, metres.
        support: z of what it stands on.
    """
    points = np.asarray(cloud, dtype=np.float64)
    top = float(np.percentile(points[:, 2], 99))
    rim = points[(points[:, 2] > top - _RIM_DEPTH) & (points[:, 2] < top + _THINNEST)]
    middle = 0.5 * (rim[:, :2].min(axis=0) + rim[:, :2].max(axis=0))
    pieces, radius = _sectors(rim, middle)
    if any(len(piece) < _FEWEST_POINTS for piece in pieces):  # of a rim that is seen in part the box has another middle
        middle = _circle_middle(rim[:, :2])
        pieces, radius = _sectors(rim, middle)
    return [
        solid_hull(piece if len(piece) >= _FEWEST_POINTS else _arc(middle, radius, number, top), support)
        for number, piece in enumerate(pieces)
    ]


def _sectors(rim: np.ndarray, middle: np.ndarray) -> tuple[list[np.ndarray], float]:
    """Return the points (P, 3) of each sector of a rim, and how far out most of the rim is."""
    offset = rim[:, :2] - middle
    radius = np.linalg.norm(offset, axis=1)
    typical = float(np.percentile(radius, 75))
    outer = radius > 0.6 * typical  # what lies farther in is seen of the inside, not of the rim
    sector = np.floor((np.arctan2(offset[:, 1], offset[:, 0]) + math.pi) / (2 * math.pi) * WALLS).astype(int) % WALLS
    return [rim[(sector == number) & outer] for number in range(WALLS)], typical


def _circle_middle(points: np.ndarray) -> np.ndarray:
    """Return the middle (2,) of the algebraic least-squares circle through points (P, 2) (Kasa, 1976)."""
    center = points.mean(axis=0)
    relative = points - center
    system = np.column_stack((relative, np.ones(len(points))))
    solution, *_ = np.linalg.lstsq(system, (relative**2).sum(axis=1), rcond=None)
    return center + solution[:2] / 2


def _arc(middle: np.ndarray, radius: float, number: int, top: float) -> np.ndarray:
    """Return points (P, 3) of a rim's sector that was not seen."""
    angles = -math.pi + 2 * math.pi * (number + np.linspace(0.0, 1.0, 6)) / WALLS
    around = np.stack((np.cos(angles), np.sin(angles)), axis=1)
    ring = np.concatenate([middle + r * around for r in (radius - _THINNEST, radius)])
    return np.column_stack((ring, np.full(len(ring), top)))
