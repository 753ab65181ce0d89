"""Parts that are one object: the inside of a mug and its outside, a plate's rim and its middle."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import cKDTree

_WITHIN = 0.5  # of the smaller part's outline, seen from above, lies in the other's: apart, they would intersect
_HOLLOW = -0.3  # the normals of a solid seen from outside diverge (1 for a ball), those of an inside meet (-1)
_RIM = 0.025  # m between the inside and the outside: a wall, and what the camera loses of it
_RIM_HEIGHT = 0.02  # m between their upper ends


def joined(part: np.ndarray, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Parts with those joined that stand in each other's place, or are the inside and the outside of one thing.

    Args:
        part: (V,) the part of each voxel, -1 for none.
        positions: (V, 3) level frame, metres.
        normals: (V, 3) unit, toward the camera.
    """
    part = part.copy()
    for hollow in np.unique(part[part >= 0]):
        if _hollowness(positions[part == hollow], normals[part == hollow]) > _HOLLOW:
            continue
        outside = _around(int(hollow), part, positions)
        part[part == hollow] = outside
    outlines = {k: _outline(positions[part == k]) for k in np.unique(part[part >= 0])}
    while pair := _intersecting(outlines):
        small, large = pair
        part[part == small] = large
        outlines[large] = _outline(positions[part == large])
        del outlines[small]
    return part


def _hollowness(positions: np.ndarray, normals: np.ndarray) -> float:
    """How much the normals point away from the part's middle, seen from above: -1 to 1."""
    from_middle = positions[:, :2] - positions[:, :2].mean(axis=0)
    weight = np.linalg.norm(normals[:, :2], axis=1) * np.linalg.norm(from_middle, axis=1)
    return float((normals[:, :2] * from_middle).sum() / max(weight.sum(), 1e-9))


def _around(hollow: int, part: np.ndarray, positions: np.ndarray) -> int:
    """The part whose inside the hollow one is: the nearest that ends at about the same height; else itself."""
    inside, others = part == hollow, (part >= 0) & (part != hollow)
    if not others.any():
        return hollow
    away, _ = cKDTree(positions[inside]).query(positions[others])
    top = positions[inside, 2].max()
    best, least = hollow, _RIM
    for other in np.unique(part[others]):
        members = part[others] == other
        if abs(positions[others][members, 2].max() - top) < _RIM_HEIGHT and away[members].min() < least:
            best, least = int(other), float(away[members].min())
    return best


def _intersecting(outlines: dict[int, shapely.Polygon]) -> tuple[int, int] | None:
    """Two parts of which the smaller lies in the larger, seen from above."""
    order = sorted(outlines, key=lambda k: outlines[k].area)
    for place, small in enumerate(order):
        for large in order[place + 1 :]:
            if outlines[small].intersection(outlines[large]).area > _WITHIN * outlines[small].area:
                return small, large
    return None


def _outline(positions: np.ndarray) -> shapely.Polygon:
    return shapely.MultiPoint(positions[:, :2]).convex_hull.buffer(0.002)
