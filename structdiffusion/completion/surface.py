"""Complete the cloud of a partly seen object with points of the surface that the camera did not see."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from scipy.spatial import ConvexHull, QhullError

from structdiffusion.completion.methods import complete
from structdiffusion.completion.view import View
from structdiffusion.footprints import stands_above
from structdiffusion.observation import ObjectCloud, Scene


def completed_scene(scene: Scene) -> Scene:
    """Return a scene with the points of the hidden sides of its objects; the distractors stay as they were seen."""
    every = (*scene.objects, *scene.distractors)
    outlines = [shapely.MultiPoint(cloud.points[:, :2]).convex_hull for cloud in every]
    bottoms = [cloud.bottom for cloud in every]
    objects = []
    for index, cloud in enumerate(scene.objects):
        covered = any(stands_above(upper, index, outlines, bottoms) for upper in range(len(every)))
        points = completed_points(cloud, scene.world_from_camera, covered)
        objects.append(replace(cloud, points=points.astype(np.float32), colors=None))
    return replace(scene, objects=tuple(objects))


def completed_points(cloud: ObjectCloud, world_from_camera: np.ndarray | None, covered: bool = False) -> np.ndarray:
    """Return the seen points of an object and points of its hidden sides: (P, 3) float64, world frame.

    The hidden sides have about as many points to the area as the completed body's whole surface has seen ones.

    Args:
        cloud: the seen points.
        world_from_camera: (4, 4), or `None`; then nothing is known to be hidden.
        covered: whether something stands on it. Then its top is not seen, and nothing tells how far its sides reach
            back: it is taken to fill a rectangle around what is seen, if it is not round.
    """
    points = np.asarray(cloud.points, dtype=np.float64)
    if world_from_camera is None or len(points) < 4:
        return points
    shape = complete(cloud, world_from_camera)
    if covered and not shape.symmetry:
        return np.concatenate((points, _surface_points((_prism(points, cloud.bottom),), len(points))))
    drawn = _surface_points(shape.parts, len(points))
    hidden = drawn[View(points, world_from_camera[:3, 3]).hidden(drawn)]
    return np.concatenate((points, hidden))


def _surface_points(parts: tuple[np.ndarray, ...], count: int) -> np.ndarray:
    """Draw points (`count`, 3) evenly on the hulls of convex parts (V, 3), the same at each call."""
    triangles = np.concatenate(
        [found for part in parts if (found := _triangles(part)) is not None] or [np.empty((0, 3, 3))]
    )
    if not len(triangles):
        return np.empty((0, 3))
    rng = np.random.default_rng(0)
    sides = triangles[:, 1:] - triangles[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    chosen = rng.choice(len(triangles), count, p=areas / areas.sum())
    share = np.sort(rng.uniform(size=(count, 2)), axis=1)
    weights = np.column_stack((share[:, 0], share[:, 1] - share[:, 0], 1.0 - share[:, 1]))
    return np.einsum("nk,nkd->nd", weights, triangles[chosen])


def _prism(points: np.ndarray, bottom: float) -> np.ndarray:
    """Return the corners (8, 3) of an upright prism over the rectangle around points (P, 3) to whose sides they lie
    nearest on average.

    Around two faces of a box the smallest rectangle has two solutions of the same area, and the other one lies across.
    """
    headings = np.deg2rad(np.arange(90.0))
    axes = np.stack((np.cos(headings), np.sin(headings), -np.sin(headings), np.cos(headings)), axis=1).reshape(-1, 2, 2)
    along = axes @ points[:, :2].T  # (90, 2, P)
    low, high = along.min(axis=2, keepdims=True), along.max(axis=2, keepdims=True)
    best = int(np.minimum(along - low, high - along).min(axis=1).mean(axis=1).argmin())
    (left, near), (right, far) = low[best, :, 0], high[best, :, 0]
    corners = np.array([(left, near), (left, far), (right, far), (right, near)]) @ axes[best]
    return np.concatenate([np.column_stack((corners, np.full(4, z))) for z in (bottom, points[:, 2].max())])


def _triangles(part: np.ndarray) -> np.ndarray | None:
    try:
        return part[ConvexHull(part).simplices]
    except (QhullError, ValueError):
        return None
