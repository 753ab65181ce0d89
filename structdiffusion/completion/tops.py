"""Detect tops that slope down to all sides, as those of fruit and balls do."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from structdiffusion.footprints import outline_centroid

# Toward its outline an ellipsoid falls by 0.09 of its height, a level top by 0, a bottle by 0.14 and more. Units: m;
# shares of the height.
_FALLS, _ROUND = 0.0025, (0.06, 0.13)
_MIDDLE, _BORDER = 0.35, (0.5, 0.7)  # shares of the distance from the middle to the outline
_FEWEST = 6  # points needed for a median


def is_rounded(points: np.ndarray, height: float) -> bool:
    """Return whether points (P, 3) of an object of this height, metres, slope down to all sides as on an ellipsoid."""
    low, high = _ROUND
    return max(_FALLS, low * height) < fall_of_top(points) < max(2 * _FALLS, high * height)


def fall_of_top(points: np.ndarray) -> float:
    """Return how much lower, metres, points (P, 3) are toward their outline than in the middle;
    0 for too few points.
    """
    try:
        outline = points[ConvexHull(points[:, :2]).vertices, :2]
    except (QhullError, ValueError):
        return 0.0
    middle = outline_centroid(outline)
    corners = outline - middle
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack((edges[:, 1], -edges[:, 0]))
    # Distance of each point from the middle as a share of that of the outline.
    out = ((points[:, :2] - middle) @ (normals / (normals * corners).sum(axis=1)[:, None]).T).max(axis=1)
    inner = points[out < _MIDDLE, 2]
    border = points[(out > _BORDER[0]) & (out < _BORDER[1]), 2]
    if min(len(inner), len(border)) < _FEWEST:
        return 0.0
    return float(np.median(inner) - np.median(border))
