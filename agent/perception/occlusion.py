"""Join the parts of one object that something in front of it divides."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

_LEAST = 30  # voxels of a part that is looked at
_FARTHEST = 0.12  # m between the parts
_WIDEST = 0.3  # m across both
_ALIKE = 12.0  # apart in CIELAB: one colour in light and shade
_AS_HIGH = 0.015  # m between their upper ends
_BETWEEN = np.linspace(0.15, 0.85, 6)  # places between two parts, from one to the other
_BESIDE = 0.008  # radians from the line of sight: two voxels at half a metre
_NEARER = 0.01  # m by which what hides a place is nearer than the place


def rejoined(part: np.ndarray, positions: np.ndarray, lab: np.ndarray | None, eye: np.ndarray) -> np.ndarray:
    """Join parts that are alike in height and colour, and between which something nearer hides everything.

    Args:
        part: (V,) the part of each voxel, -1 for none.
        positions: (V, 3) level frame, metres.
        lab: (V, 3) colours in CIELAB; `None` joins nothing, because height alone is no evidence.
        eye: (3,) where the camera is.
    """
    if lab is None:
        return part
    part = part.copy()
    sight = positions - eye
    distance = np.linalg.norm(sight, axis=1)
    directions = cKDTree(sight / distance[:, None])
    large = [k for k, size in zip(*np.unique(part[part >= 0], return_counts=True), strict=True) if size >= _LEAST]
    top = {k: np.percentile(positions[part == k, 2], 95) for k in large}
    color = {k: np.median(lab[part == k], axis=0) for k in large}
    for place, one in enumerate(large):
        for other in large[place + 1 :]:
            if abs(top[one] - top[other]) > _AS_HIGH or np.linalg.norm(color[one] - color[other]) > _ALIKE:
                continue
            own, its = positions[part == one], positions[part == other]
            if not len(own) or np.ptp(np.vstack((own, its))[:, :2], axis=0).max() > _WIDEST:
                continue
            away, nearest = cKDTree(its).query(own)
            first = int(away.argmin())
            if away[first] > _FARTHEST:
                continue
            # At one height: the nearest voxels may be at the foot of both.
            between = own[first] + _BETWEEN[:, None] * (its[nearest[first]] - own[first])
            if _hidden(between, eye, directions, distance, (part != one) & (part != other)):
                part[part == one] = other
                break
    return part


def _hidden(
    places: np.ndarray, eye: np.ndarray, directions: cKDTree, distance: np.ndarray, allowed: np.ndarray
) -> bool:
    """Return whether something hides every place (P, 3): a voxel (V,) of those allowed, near its line of sight."""
    sight = places - eye
    length = np.linalg.norm(sight, axis=1)
    found = directions.query_ball_point(sight / length[:, None], _BESIDE)
    return all(
        (allowed[near] & (distance[near] < far - _NEARER)).any() for near, far in zip(found, length, strict=True)
    )
