"""What the camera cannot see of an object: its far side, guessed by symmetry, so that the arm keeps clear of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from structdiffusion.observation import ObjectCloud, Scene

_TOP_SHARE, _TOP = 0.98, 0.008  # quantile of the heights, and m below it, that belong to the top
_LOW = 0.04  # m: what is lower shows all of its outline to a camera above
_SAME_RAY = 0.006  # rad between two rays that count as one: about the distance of two points of a cloud, seen from 1 m
_BEHIND = 0.003  # m that a hidden point lies farther away than what hides it


def completed(points: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """The points, and those of the far side that the object itself hides from the camera.

    Most things that stand on tables look alike from two opposite sides: every point is turned by half about the upright
    axis through the middle of the top, and kept where the camera could not have seen it, behind what it saw.

    Args:
        points: (P, 3) a partial cloud, world frame, metres.
        eye: (3,) where the camera is.

    Returns:
        (P + Q, 3), the seen ones first.
    """
    points = np.asarray(points, dtype=np.float64)
    if np.ptp(points[:, 2]) < _LOW:
        return points
    top = points[points[:, 2] > np.quantile(points[:, 2], _TOP_SHARE) - _TOP, :2]
    middle = 0.5 * (top.min(axis=0) + top.max(axis=0))
    turned = np.column_stack((2 * middle - points[:, :2], points[:, 2]))
    seen, guessed = points - eye, turned - eye
    far, farther = np.linalg.norm(seen, axis=1), np.linalg.norm(guessed, axis=1)
    angle, nearest = cKDTree(seen / far[:, None]).query(guessed / farther[:, None])
    hidden = (angle < _SAME_RAY) & (farther > far[nearest] + _BEHIND)
    return np.concatenate((points, turned[hidden]))


def completed_clouds(clouds: Sequence[ObjectCloud], scene: Scene) -> list[np.ndarray]:
    """The points (P + Q, 3) of every cloud with its far side; just the seen ones where the scene knows no camera."""
    if scene.world_from_camera is None:
        return [np.asarray(cloud.points, dtype=np.float64) for cloud in clouds]
    return [completed(cloud.points, scene.world_from_camera[:3, 3]) for cloud in clouds]
