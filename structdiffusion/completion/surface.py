"""Complete the cloud of a partly seen object with points of the surface that the camera did not see."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from structdiffusion.completion.methods import are_covered, complete
from structdiffusion.completion.view import View
from structdiffusion.observation import ObjectCloud, Scene


def completed_scene(scene: Scene) -> Scene:
    """Return a scene with the points of the hidden sides of its objects; the distractors stay as they were seen."""
    objects = []
    for cloud, covered in zip(scene.objects, are_covered((*scene.objects, *scene.distractors))):
        points = completed_points(cloud, scene.world_from_camera, covered)
        objects.append(replace(cloud, points=points.astype(np.float32), colors=None))
    return replace(scene, objects=tuple(objects))


def completed_points(cloud: ObjectCloud, world_from_camera: np.ndarray | None, covered: bool = False) -> np.ndarray:
    """Return the seen points of an object and points of its hidden sides: (P, 3) float64, world frame.

    The hidden sides have about as many points to the area as the completed body's whole surface has seen ones.

    Args:
        cloud: the seen points.
        world_from_camera: (4, 4), or `None`; then nothing is known to be hidden.
        covered: whether something stands on it, as for `complete`.
    """
    points = np.asarray(cloud.points, dtype=np.float64)
    if world_from_camera is None or len(points) < 4:
        return points
    shape = complete(cloud, world_from_camera, covered=covered)
    drawn = _surface_points(shape.parts, len(points))
    if shape.symmetry == "prism":  # what stands on it hides it too
        return np.concatenate((points, drawn))
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


def _triangles(part: np.ndarray) -> np.ndarray | None:
    try:
        return part[ConvexHull(part).simplices]
    except (QhullError, ValueError):
        return None
