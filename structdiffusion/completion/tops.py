"""Whether what is seen of a thing from above falls off to all its sides, as fruit and balls do."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from structdiffusion.footprints import outline_centroid

# On the way to its outline an ellipsoid falls by 0.09 of its height, a level top by 0, a bottle by 0.14 and more. m; of
# the height
_FALLS, _ROUND = 0.0025, (0.06, 0.13)
_MIDDLE, _BORDER = 0.35, (0.5, 0.7)  # of the way from the middle to the outline
_FEWEST = 6  # points of which a median is taken


def is_rounded(points: np.ndarray, height: float) -> bool:
    """Whether points (P, 3) of a thing of this height, metres, fall off to all sides like those of an ellipsoid."""
    low, high = _ROUND
    return max(_FALLS, low * height) < fall_of_top(points) < max(2 * _FALLS, high * height)


def fall_of_top(points: np.ndarray) -> float:
    """By how much, metres, points (P, 3) are lower on the way to their outline than in its middle; 0 of too few."""
    try:
        outline = points[ConvexHull(points[:, :2]).vertices, :2]
    except (QhullError, ValueError):
        return 0.0
    middle = outline_centroid(outline)
    corners = outline - middle
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack((edges[:, 1], -edges[:, 0]))
    # How far out each point is, 1 on the outline.
    out = ((points[:, :2] - middle) @ (normals / (normals * corners).sum(axis=1)[:, None]).T).max(axis=1)
    inner = points[out < _MIDDLE, 2]
    border = points[(out > _BORDER[0]) & (out < _BORDER[1]), 2]
    if min(len(inner), len(border)) < _FEWEST:
        return 0.0
    return float(np.median(inner) - np.median(border))
