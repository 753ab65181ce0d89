"""Find how objects come to rest inside another one, by letting their completed bodies fall into it.

An object that fits stays upright; one that is too long leans on the rim. The resting pose is predicted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely

from structdiffusion.completion.estimate import front_yaw
from structdiffusion.composition.items import Item
from structdiffusion.evaluation_protocol import MIN_DEPTH_INSIDE
from structdiffusion.footprints import outline_centroid
from structdiffusion.geometry import pose_from_xyz_rpy, pose_from_xyz_yaw, tilt_between, transform_points
from structdiffusion.observation import Table
from structdiffusion.simulation.world import TabletopWorld
from structdiffusion.structures.bodies import PlacedBody
from structdiffusion.structures.structure import LayoutError

_TILTS = tuple(
    math.radians(degrees) for degrees in (0, 75, 55, 35, -75, -55, -35)
)  # tried in turn; the wider end goes down first
_YAWS = (0.0, math.pi / 2, math.pi / 4, -math.pi / 4)  # about the vertical, tried for each tilt
_DEEPER = 0.005  # m below the protocol's depth: the rim is known to a few millimetres
_OPENING = 0.85  # of a vessel's outline; what is to stand upright in it must be narrower
_ABOVE = 0.004  # m above the highest point of the vessel, from where an object falls
_PUSHED = 0.008  # m by which the vessel may be pushed
_SETTLE = 2.0  # s
_RAISED = 0.006  # m above the resting pose: the contact is known to a few millimetres
_MOST = 28  # falls of one object


def rest_inside(vessel: Item, things: Sequence[Item], wanted: int, rng: np.random.Generator) -> list[list[np.ndarray]]:
    """Return ways in which objects come to rest inside a vessel that stays in place.

    Args:
        vessel: the vessel.
        things: the objects in the order of their placement.
        wanted: how many different ways are looked for.
        rng: of the places over the vessel.

    Returns:
        For each way the motion (4, 4) of each thing, world frame.

    Raises:
        LayoutError: if the vessel is not hollow, or one of them does not go in.
    """
    if not vessel.hollow:
        raise LayoutError(f"nothing can be put into the {vessel.name}: it is not hollow")
    ways: list[list[np.ndarray]] = []
    for first in range(wanted):
        inside: list[tuple[Item, np.ndarray]] = []
        for thing in things:
            motion = _falls_in(vessel, inside, thing, rng, first)
            if motion is None:
                break
            inside.append((thing, motion))
        else:
            ways.append([motion for _, motion in inside])
            continue
        if not ways and first == wanted - 1:
            raise LayoutError(
                f"the {thing.name} does not fit into the {vessel.name}: it does not come to rest below its rim"
            )
    return ways


def _falls_in(
    vessel: Item, inside: Sequence[tuple[Item, np.ndarray]], thing: Item, rng: np.random.Generator, first: int
) -> np.ndarray | None:
    """Return the first motion (4, 4) of an object that ends inside the vessel, or `None`."""
    fits = _fits_upright(vessel, thing)
    attempts = [(tilt, yaw) for tilt in _TILTS for yaw in _YAWS if tilt or fits]
    attempts = attempts[first % len(attempts) :] + attempts[: first % len(attempts)] if not fits else attempts
    radius = float(np.linalg.norm(vessel.outline - vessel.centroid, axis=1).min())
    ready = [vessel, *(item for item, _ in inside)]
    poses = [vessel.pose, *(motion @ item.pose for item, motion in inside)]
    wide = Table(-2.0, 2.0, -2.0, 2.0)
    for tilt, yaw in attempts[:_MOST]:
        pose = thing.pose.copy()
        spread = 0.12 * radius * rng.standard_normal(2) * (len(inside) + first > 0)
        turned = pose_from_xyz_rpy((0, 0, 0), (0, tilt, 0)) @ _along_x(thing)
        pose = pose_from_xyz_yaw(0, 0, 0, yaw) @ turned
        low = float(transform_points(pose, np.concatenate(thing.model.hulls))[:, 2].min())
        pose[:3, 3] += (*(vessel.centroid + spread), vessel.top + _ABOVE - low)
        with TabletopWorld([*(item.model for item in ready), thing.model], [*poses, pose], wide) as world:
            world.settle(_SETTLE)
            ends = world.poses()
            near = world.clearances(len(ready))
        if (
            float(np.linalg.norm(ends[0][:2, 3] - vessel.pose[:2, 3])) > _PUSHED
            or tilt_between(ends[0], vessel.pose) > 0.1
        ):
            continue
        touches = {other for other, gap in near.items() if gap < 0.001}
        if _is_inside(vessel, thing, ends[-1]) and not touches - set(range(len(ready))):
            end = ends[-1].copy()
            end[2, 3] += _RAISED
            return end @ np.linalg.inv(thing.pose)
    return None


def _along_x(thing: Item) -> np.ndarray:
    """Return the motion (4, 4) that brings an object's middle to the origin and its wider end along x.

    The wider end is mostly the heavier one: down in a vessel, it stays there.
    """
    points = np.concatenate(thing.model.hulls)
    turn = pose_from_xyz_yaw(0, 0, 0, -front_yaw(thing.model.surface_points))
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    turn[:3, 3] = -turn[:3, :3] @ middle
    return turn


def _fits_upright(vessel: Item, thing: Item) -> bool:
    """Return whether an object as it stands is narrower than the vessel's opening."""
    opening = shapely.Polygon(_OPENING * (vessel.outline - vessel.centroid))
    outline = thing.outline - thing.centroid
    return bool(
        opening.area > 0.9 * shapely.Polygon(outline).area and opening.buffer(0.003).contains(shapely.Polygon(outline))
    )


def _is_inside(vessel: Item, thing: Item, pose: np.ndarray) -> bool:
    body = body_at(thing, pose)
    over = shapely.Polygon(vessel.outline).contains(shapely.Point(body.centroid))
    return bool(over) and body.z_bottom < vessel.top - MIN_DEPTH_INSIDE - _DEEPER


def body_at(thing: Item, pose: np.ndarray) -> PlacedBody:
    """Return an object as checks see it at any pose world_from_object (4, 4), upright or not."""
    points = transform_points(pose, np.concatenate(thing.model.hulls))
    hull = np.asarray(shapely.get_coordinates(shapely.MultiPoint(points[:, :2]).convex_hull))[:-1][::-1]
    yaw = math.atan2(pose[1, 0], pose[0, 0])
    low, high = float(points[:, 2].min()), float(points[:, 2].max())
    return PlacedBody(thing.name, thing.cloud.category, hull, outline_centroid(hull), low, high, yaw, ())
