"""Rigid bodies for partly seen objects, for the simulated twin of a recorded scene and for physics rollouts."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from scipy.spatial import ConvexHull, QhullError

from structdiffusion.completion.estimate import front_yaw
from structdiffusion.completion.methods import BEST, CompletedShape, are_covered, complete
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects.model import ObjectModel, footprint_centroid
from structdiffusion.objects.solids import assemble
from structdiffusion.observation import ObjectCloud, Scene
from structdiffusion.tableware import CUTLERY

DENSITY = 400.0  # kg/m^3: between an empty carton and a full can
FRICTION = 0.5
_GRAY = (0.62, 0.63, 0.65)
_GAP = 0.001  # m between bodies that were cut to separate them
_TOUCHING = 0.001  # m by which heights may overlap where one object stands on another
_SEEN_CUT = 0.05  # largest share of the seen points that a cut may remove from their body
_SMALLEST = 1e-9  # m^3: remainders of a part that are smaller are dropped


def bodies_of(
    clouds: Sequence[ObjectCloud], world_from_camera: np.ndarray | None, method: str = BEST
) -> list[tuple[ObjectModel, np.ndarray]]:
    """Return a rigid body for each object of a scene, clear of its neighbours, and its pose world_from_object (4, 4).

    Args: see `body_of`.
    """
    return [(model, pose) for _, model, pose in completed_bodies_of(clouds, world_from_camera, method)]


def completed_bodies_of(
    clouds: Sequence[ObjectCloud], world_from_camera: np.ndarray | None, method: str = BEST
) -> list[tuple[CompletedShape, ObjectModel, np.ndarray]]:
    """Return the completed shape of each object beside what `bodies_of` returns.

    Args: see `body_of`.
    """
    shapes = separated(
        [complete(cloud, world_from_camera, method, covered) for cloud, covered in zip(clouds, are_covered(clouds))]
    )
    return [(shape, *_body(cloud, shape)) for cloud, shape in zip(clouds, shapes, strict=True)]


def bodies_of_scene(scene: Scene) -> tuple[list[ObjectModel], np.ndarray, list[tuple[ObjectModel, np.ndarray]]]:
    """Return the bodies that `TabletopBodies` takes to try arrangements on completed shapes, from observed data alone.

    Returns:
        the models of the N objects that take part, their poses world_from_object (N, 4, 4), and the distractors, each
        with its pose.
    """
    bodies = bodies_of((*scene.objects, *scene.distractors), scene.world_from_camera)
    own = bodies[: len(scene.objects)]
    return [model for model, _ in own], np.array([pose for _, pose in own]), bodies[len(own) :]


def body_of(
    cloud: ObjectCloud, world_from_camera: np.ndarray | None, method: str = BEST
) -> tuple[ObjectModel, np.ndarray]:
    """Return a rigid body for an object, and its pose world_from_object (4, 4): upright, and on its support.

    Args:
        cloud: the partial cloud of the object.
        world_from_camera: (4, 4), or `None`.
        method: one of `structdiffusion.completion.methods.METHODS`.
    """
    return _body(cloud, complete(cloud, world_from_camera, method))


def _body(cloud: ObjectCloud, shape: CompletedShape) -> tuple[ObjectModel, np.ndarray]:
    color = _GRAY
    if cloud.colors is not None and len(cloud.colors):
        color = tuple((np.median(cloud.colors, axis=0) / 255).tolist())
    # The checks of a table setting take the object's +x for its front.
    yaw = front_yaw(cloud.points) if cloud.category in CUTLERY else 0.0
    world_from_turned = pose_from_xyz_yaw(0.0, 0.0, 0.0, yaw)
    parts = [transform_points(world_from_turned.T, part) for part in shape.parts]
    model = assemble(
        cloud.name, cloud.category, parts, density=DENSITY, friction=FRICTION, color=color, source="recorded",
        rng=np.random.default_rng(0),
    )  # fmt: skip
    points = np.concatenate(shape.parts)
    x, y = footprint_centroid(points[:, :2])
    return model, pose_from_xyz_yaw(x, y, float(points[:, 2].min()), yaw)


def separated(shapes: Sequence[CompletedShape]) -> list[CompletedShape]:
    """Cut shapes that were completed into each other by an upright plane, midway between the seen points of both."""
    shapes = list(shapes)
    for i, j in itertools.combinations(range(len(shapes)), 2):
        if not _overlap(shapes[i].parts, shapes[j].parts):
            continue
        cut = _between(shapes[i].seen, shapes[j].seen)
        if cut is None:
            continue
        normal, at = cut
        for index, sign in ((i, -1.0), (j, 1.0)):
            parts = [_behind(part, sign * normal, sign * at + _GAP / 2) for part in shapes[index].parts]
            if left := tuple(part for part in parts if part is not None):
                shapes[index] = replace(shapes[index], parts=left)
    return shapes


def _overlap(some: Sequence[np.ndarray], others: Sequence[np.ndarray]) -> bool:
    """Return whether two bodies overlap both in plan and in height."""
    (low, high), (other_low, other_high) = (_box(parts) for parts in (some, others))
    if (low > other_high).any() or (other_low > high).any():
        return False
    outlines = [[shapely.MultiPoint(part[:, :2]).convex_hull for part in parts] for parts in (some, others)]
    if not shapely.union_all(outlines[0]).intersects(shapely.union_all(outlines[1])):
        return False
    tree = shapely.STRtree(outlines[1])
    for part, outline in zip(some, outlines[0], strict=True):
        for near in tree.query(outline, predicate="intersects"):
            other = others[near]
            shared = min(part[:, 2].max(), other[:, 2].max()) - max(part[:, 2].min(), other[:, 2].min())
            if shared > _TOUCHING and outline.intersection(outlines[1][near]).area > _TOUCHING**2:
                return True
    return False


def _box(parts: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest coordinates (3,) of a body's parts."""
    points = np.concatenate(parts)
    return points.min(axis=0), points.max(axis=0)


def _between(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Return the upright plane between two sets of seen points (P, 3): its normal (3,) toward the other, its offset.

    `None` if no plane separates them, as with a spoon in a cup.
    """
    outlines = [shapely.MultiPoint(points[:, :2]).convex_hull for points in (one, other)]
    nearest = shapely.shortest_line(*outlines)
    ends = shapely.get_coordinates(nearest)
    toward = ends[1] - ends[0]
    if np.linalg.norm(toward) < 1e-6:
        toward = other[:, :2].mean(axis=0) - one[:, :2].mean(axis=0)
        if np.linalg.norm(toward) < 1e-6:
            return None
        toward /= np.linalg.norm(toward)
        along, across = one[:, :2] @ toward, other[:, :2] @ toward
        at = 0.5 * float(np.quantile(along, 1 - _SEEN_CUT) + np.quantile(across, _SEEN_CUT))
        if (along > at).mean() > _SEEN_CUT or (across < at).mean() > _SEEN_CUT:
            return None
    else:
        toward /= np.linalg.norm(toward)
        at = float(0.5 * (ends[0] + ends[1]) @ toward)
    return np.append(toward, 0.0), at


def _behind(part: np.ndarray, normal: np.ndarray, at: float) -> np.ndarray | None:
    """Return the piece of a convex part (V, 3) where `normal @ point` is at least `at`; `None` if it is negligible."""
    distance = part @ normal - at
    if (distance >= 0).all():
        return part
    edges = ConvexHull(part).simplices[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    crossing = edges[distance[edges[:, 0]] * distance[edges[:, 1]] < 0]
    share = distance[crossing[:, 0]] / (distance[crossing[:, 0]] - distance[crossing[:, 1]])
    met = part[crossing[:, 0]] + share[:, None] * (part[crossing[:, 1]] - part[crossing[:, 0]])
    kept = np.concatenate((part[distance >= 0], met))
    try:
        hull = ConvexHull(kept)
    except (QhullError, ValueError):
        return None
    return kept[hull.vertices] if hull.volume > _SMALLEST else None
