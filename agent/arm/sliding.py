"""Slide what the hand cannot lift along the table: the way of the hand with the object between its fingers."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np
from shapely import MultiPoint

from agent.arm.grasps import Grasp
from agent.arm.kinematics import Kinematics
from agent.arm.trajectories import WAYPOINTS, straight_line
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points, yaw_of

LEVEL = 0.005  # m by which a goal may be higher or lower than the table
UPRIGHT = math.cos(math.radians(5.0))  # of the tilt up to which a motion counts as one along the table
MIDDLE = 0.03  # m from its middle up to which an object is taken in the middle
AHEAD = math.cos(math.radians(45.0))  # of the angle between the way and where the hand is, seen from the middle
WAY_CLEARANCE = 0.01  # m beside what is slid


def is_along_table(goal_from_now: np.ndarray) -> bool:
    """Return whether a motion (4, 4) leaves an object upright on the table that carries it."""
    return bool(goal_from_now[2, 2] > UPRIGHT and abs(goal_from_now[2, 3]) < LEVEL)


def way_along_table(goal_from_now: np.ndarray, cloud: np.ndarray) -> np.ndarray:
    """Return the points (Q, 3) of an object (P, 3) now and at its goal,
    whose outline it needs free to be slid there.
    """
    return np.concatenate((cloud, transform_points(goal_from_now, cloud)))


def keep_ways_free(
    ways: Mapping[int, np.ndarray],
    done: Collection[int],
    clouds: Sequence[np.ndarray],
    motions: Sequence[np.ndarray],
    in_the_way: Sequence[set[int]],
) -> None:
    """Add what stands in the way of objects that are slid to `in_the_way`, and them to that of what will stand in it.

    Args:
        ways: object -> the points (Q, 3) of its way.
        done: the objects that are placed.
        clouds: (P, 3) each, now. motions: goal_from_now (4, 4) of each.
        in_the_way: of each object, the others that have to be moved first.
    """
    for i, points in ways.items():
        way = MultiPoint(points[:, :2]).convex_hull.buffer(WAY_CLEARANCE)
        for j, cloud in enumerate(clouds):
            if j == i or j in done:
                continue
            if way.intersects(MultiPoint(cloud[:, :2]).convex_hull):
                in_the_way[i].add(j)
            if way.intersects(MultiPoint(transform_points(motions[j], cloud)[:, :2]).convex_hull):
                in_the_way[j].add(i)


def leads(grasp: Grasp, cloud: np.ndarray, goal_from_now: np.ndarray) -> bool:
    """Return whether the hand goes ahead of the object, or has it in its middle: what is pushed from behind turns away.

    Args:
        grasp: how the hand takes it.
        cloud: (P, 3) the object, now.
        goal_from_now: (4, 4) its motion.
    """
    middle = 0.5 * (cloud.min(axis=0) + cloud.max(axis=0))
    way, off = (transform_points(goal_from_now, middle) - middle)[:2], (grasp.world_from_ee[:3, 3] - middle)[:2]
    return bool(np.linalg.norm(off) < MIDDLE or off @ way > AHEAD * np.linalg.norm(off) * np.linalg.norm(way))


def sliding_path(
    kinematics: Kinematics, start: np.ndarray, world_from_ee: np.ndarray, goal_from_now: np.ndarray, middle: np.ndarray
) -> np.ndarray | None:
    """Return the joint path (T, n) along which the hand brings an object to its goal without lifting it.

    The object's middle moves straight, while the object turns evenly.

    Args:
        kinematics: the kinematics of the arm.
        start: (n,) the configuration at the grasp.
        world_from_ee: (4, 4) the hand there.
        goal_from_now: (4, 4) the motion of the object.
        middle: (3,) of the object, now.

    Returns:
        The path from `start` on, or `None` if it is out of reach.
    """
    way, turn = transform_points(goal_from_now, middle) - middle, yaw_of(goal_from_now)
    poses = []
    for share in np.linspace(0.0, 1.0, WAYPOINTS + 1):
        there = middle + share * way
        moved = pose_from_xyz_yaw(there[0], there[1], there[2], share * turn)
        moved = moved @ pose_from_xyz_yaw(-middle[0], -middle[1], -middle[2], 0.0)
        poses.append(moved @ world_from_ee)
    return straight_line(kinematics, start, poses)
