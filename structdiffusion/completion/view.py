"""View of one object by a camera: denoised points, and a test of which completed points it rules out."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

_STRAYS = 4.0  # times the typical distance of neighbours: points farther from all others are strays
_FEWEST = 12  # points needed for statistics of neighbours
_NEIGHBOURS = 10
_SAME_SURFACE = 0.010  # m: largest depth difference of neighbouring pixels on one surface
# times the typical distance of neighbours: directions this close to a seen point are in the silhouette
_SILHOUETTE = 2.5
EDGE = 0.0007  # m that an outline loses at its border pixels
_LEVEL = 0.003  # m below a level top that belong to it
_WITHIN = 0.004  # m: depths that differ by less count as equal


def without_strays(points: np.ndarray) -> np.ndarray:
    """Remove isolated points from points (P, 3): depth cameras produce some between an edge and what is behind it."""
    if len(points) < _FEWEST:
        return points
    distance = cKDTree(points).query(points, k=5)[0][:, 4]
    return points[distance <= max(_STRAYS * float(np.median(distance)), _WITHIN)]


class View:
    """One object's points as a camera at `eye` saw them.

    Args:
        points: (P, 3) world frame, metres.
        eye: (3,) position of the camera.

    Attributes:
        points: (P, 3) float64, moved along their rays onto a plane through their neighbours.
        eye: as given.
    """

    def __init__(self, points: np.ndarray, eye: np.ndarray) -> None:
        self.eye = np.asarray(eye, dtype=np.float64)
        rays = np.asarray(points, dtype=np.float64) - self.eye
        depths = np.linalg.norm(rays, axis=1)
        rays /= depths[:, None]
        self._tree = cKDTree(rays)
        count = min(_NEIGHBOURS, len(rays))
        apart, near = self._tree.query(rays, k=count)
        spacing = float(np.median(apart[:, min(4, count - 1)])) if count > 1 else 0.0
        self._reach = _SILHOUETTE * spacing
        self._depths = _smoothed(rays, depths, near)
        self.points = self.eye + rays * self._depths[:, None]

    def behind(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return how far points (Q, 3) lie behind the surface seen in their direction, and where no surface was seen.

        Returns:
            (Q,) metres, negative in front, and (Q,) bool: outside the object's silhouette.
        """
        rays = points - self.eye
        depths = np.linalg.norm(rays, axis=1)
        apart, nearest = self._tree.query(rays / depths[:, None])
        return depths - self._depths[nearest], apart > self._reach

    def hidden(self, points: np.ndarray) -> np.ndarray:
        """Return which of the points (Q, 3) the object itself hides, so that the camera could not have seen them."""
        behind, outside = self.behind(points)
        return ~outside & (behind > _WITHIN)

    def plausibility(self, points: np.ndarray) -> float:
        """Score how well points (Q, 3) agree with the view: plus for points on seen surface, minus for those in empty
        space.
        """
        behind, outside = self.behind(points)
        same = ~outside & (np.abs(behind) <= _WITHIN)
        against = outside | (behind < -2 * _WITHIN)
        return float(same.mean() - 1.5 * against.mean())


def _smoothed(rays: np.ndarray, depths: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return depths (P,) from a plane through those neighbours `near` (P, K) that lie on the same surface."""
    if near.shape[1] < 6:
        return depths
    forward = rays.mean(axis=0)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-3 else np.array([1.0, 0.0, 0.0])
    flat = np.stack((rays @ right, rays @ np.cross(forward, right)), axis=1)
    offset, deviation = flat[near] - flat[:, None], depths[near] - depths[:, None]
    weight = (np.abs(deviation - np.median(deviation, axis=1, keepdims=True)) < _SAME_SURFACE).astype(float)
    scale = max(float(np.abs(offset).max()), 1e-9)
    terms = np.concatenate((np.ones((*near.shape, 1)), offset / scale), axis=2)
    normal = np.einsum("pk,pki,pkj->pij", weight, terms, terms) + 0.05 * np.eye(3) * [0.0, 1.0, 1.0]
    normal[:, 0, 0] += 1e-9
    right_side = np.einsum("pk,pki,pk->pi", weight, terms, deviation)
    shift = np.linalg.solve(normal, right_side[..., None])[:, 0, 0]
    return depths + np.clip(shift, -_SAME_SURFACE, _SAME_SURFACE)


def level_top(heights: np.ndarray) -> float:
    """Return the height of a level top, metres, from the heights (P,) of all points, corrected for noise."""
    near_top = min(2 * _LEVEL, 0.35 * float(np.ptp(heights)))
    high = heights[heights >= np.quantile(heights, 0.97) - near_top]
    return max(float(np.median(high)), float(np.quantile(heights, 0.985)) - _LEVEL)


def levelled(points: np.ndarray) -> np.ndarray:
    """Flatten the points (P, 3) near a level top to its height, so that other objects can stand there."""
    top = level_top(points[:, 2])
    near = points[:, 2] > top - _LEVEL
    points = points.copy()
    # A slanted or curved surface has as many points farther below its top as near it.
    if near.sum() > 0.6 * (points[:, 2] > top - 3 * _LEVEL).sum() and np.ptp(points[:, 2]) > 6 * _LEVEL:
        points[near, 2] = top
    else:
        points[:, 2] = np.minimum(points[:, 2], np.quantile(points[:, 2], 0.99))
    return points
