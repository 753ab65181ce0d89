"""Order the placements of objects, and find free places for objects that block others."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
import shapely
from shapely import MultiPoint
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from structdiffusion.footprints import stands_above
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.observation import Table

# m around an object that is moved out of the way, for the fingers: comfortable, and just enough.
ASIDE_CLEARANCES = (0.07, 0.035, 0.02)
INSET = (0.08, 0.05)  # m between the table's edges and the middle of what was moved out of the way
PLACES_TRIED = 300
STOPOVER_TURNS = tuple(math.radians(angle) for angle in (90, -90, 180, 45, -45, 0))
STOPOVERS_PER_TURN = 2
GOAL_CLEARANCE = 0.015  # m between a goal's footprint and what still stands there


def bottom_at(motion: np.ndarray, cloud: np.ndarray, bottom: float) -> float:
    """Return z of an object's bottom after `motion` (4, 4), given its present `bottom` below the cloud (P, 3)."""
    return float(transform_points(motion, np.array([*cloud[:, :2].mean(axis=0), bottom]))[2])


def precedence(
    clouds: Sequence[np.ndarray], motions: Sequence[np.ndarray], bottoms: Sequence[float]
) -> tuple[list[set[int]], list[set[int]], list[int | None]]:
    """Return for each object which others must be placed first, for two reasons, and which one it will stand on.

    Args:
        clouds: (P, 3) per object, now. motions: goal_from_now (4, 4) per object. bottoms: z per object, now.

    Returns:
        Per object: those that will be under it; those that now stand on it, or where it will go; the one that it
        will stand on, or `None` for the table.
    """
    count = len(clouds)
    now = [MultiPoint(cloud[:, :2]).convex_hull for cloud in clouds]
    goal_clouds = [transform_points(motion, cloud) for motion, cloud in zip(motions, clouds)]
    goals = [MultiPoint(cloud[:, :2]).convex_hull for cloud in goal_clouds]
    goal_bottoms = [bottom_at(*each) for each in zip(motions, clouds, bottoms)]
    under: list[set[int]] = [set() for _ in range(count)]
    in_the_way: list[set[int]] = [set() for _ in range(count)]
    stands_on: list[int | None] = [None] * count
    for i in range(count):
        for j in range(count):
            if i == j:
                continue
            if stands_above(j, i, now, bottoms):
                in_the_way[i].add(j)
            if stands_above(i, j, goals, goal_bottoms):
                under[i].add(j)
                held_by = stands_on[i]
                if held_by is None or goal_bottoms[j] > goal_bottoms[held_by]:
                    stands_on[i] = j
            elif goals[i].distance(now[j]) < GOAL_CLEARANCE and goal_bottoms[i] < np.percentile(clouds[j][:, 2], 98):
                in_the_way[i].add(j)
    return under, in_the_way, stands_on


def staying(still: set[int], under: Sequence[set[int]]) -> set[int]:
    """Return which of the objects that are where they should be can stay there: those on none that has to be moved.

    Args:
        still: the objects. under: of every object, from `precedence`.
    """
    while off := {index for index in still if not under[index] <= still}:
        still = still - off
    return still


def asides(
    waiting: Sequence[int],
    under: Sequence[set[int]],
    in_the_way: Sequence[set[int]],
    done: set[int],
    clouds: Sequence[np.ndarray],
    distractors: Sequence[np.ndarray],
    motions: Sequence[np.ndarray],
    bottoms: Sequence[float],
    table: Table,
    rng: np.random.Generator,
) -> list[tuple[int, np.ndarray, bool]]:
    """Return steps that each move one blocking object to a free place on the table.

    Args:
        waiting: the objects that still have to be placed.
        under, in_the_way: of every object, from `precedence`. done: the placed ones.
        clouds, distractors: (P, 3) each, now. motions: goal_from_now (4, 4) of every object.
        bottoms: z of what each object stands on now.
        table: the table top.
        rng: draws the places that are tried.

    Returns:
        (object, goal_from_now (4, 4), True) per blocking object, to the nearest free place found.
    """
    taken = _outlines((*clouds, *distractors))
    goals = [MultiPoint(transform_points(motions[i], clouds[i])[:, :2]).convex_hull for i in waiting]
    # Only for those whose turn it would be: what they will stand on is there.
    blockers = {j for i in waiting if under[i] <= done for j in in_the_way[i]} - done
    now = taken[: len(clouds)]
    # What stands on a blocker has to go first.
    blockers |= {k for k in range(len(clouds)) if any(stands_above(k, j, now, bottoms) for j in blockers)} - done
    free = [j for j in blockers if not any(stands_above(k, j, now, bottoms) for k in range(len(clouds)))]
    steps = []
    for j in sorted(free, key=lambda j: taken[j].area):
        others = [shape for k, shape in enumerate(taken) if k != j] + goals
        motion = way_aside(taken[j], clouds[j][:, :2].mean(axis=0), bottoms[j], others, table, rng)
        if motion is not None:
            steps.append((j, motion, True))
    return steps


def way_aside(
    outline: BaseGeometry,
    center: np.ndarray,
    bottom: float,
    others: Sequence[BaseGeometry],
    table: Table,
    rng: np.random.Generator,
) -> np.ndarray | None:
    """Return the motion (4, 4) of something to the nearest free place found on the table, or `None`.

    Args:
        outline: its own, seen from above.
        center: (2,) its middle.
        bottom: z of what it stands on now.
        others: outlines from which it has to keep away.
        table: the table top.
        rng: draws the places that are tried.
    """
    places = _places(table, rng)
    moves = places[np.argsort(np.linalg.norm(places - center, axis=1))] - center
    room = _room(outline, moves, others)
    for clearance in ASIDE_CLEARANCES:
        if (room > clearance).any():
            x, y = moves[int((room > clearance).argmax())]
            return pose_from_xyz_yaw(x, y, -bottom, 0.0)
    return None


def stopovers(
    index: int,
    clouds: Sequence[np.ndarray],
    distractors: Sequence[np.ndarray],
    goals: Sequence[np.ndarray],
    bottom: float,
    table: Table,
    rng: np.random.Generator,
) -> list[np.ndarray]:
    """Return motions (4, 4) of an object to free places on the table, turned, from which it may be taken otherwise.

    Args:
        index: the object. clouds, distractors: (P, 3) each, now.
        goals: (P, 3) each, the clouds of the objects that still wait, at their goals.
        bottom: z of what the object stands on now.
        table: the table top.
        rng: draws the places that are tried.
    """
    cloud = clouds[index]
    center = 0.5 * (cloud[:, :2].min(axis=0) + cloud[:, :2].max(axis=0))
    others = _outlines([*(cloud for k, cloud in enumerate(clouds) if k != index), *distractors, *goals])
    # Those in the middle of the table first, where the arm is the most dexterous.
    places = _places(table, rng)
    middle = (0.5 * (table.x_min + table.x_max), 0.5 * (table.y_min + table.y_max))
    moves = places[np.argsort(np.linalg.norm(places - middle, axis=1))] - center
    motions = []
    to_origin = pose_from_xyz_yaw(-center[0], -center[1], -bottom, 0.0)
    for turn in STOPOVER_TURNS:
        turned = pose_from_xyz_yaw(center[0], center[1], 0.0, turn) @ to_origin
        (outline,) = _outlines([transform_points(turned, cloud)])
        free = moves[_room(outline, moves, others) > ASIDE_CLEARANCES[1]][:STOPOVERS_PER_TURN]
        motions += [pose_from_xyz_yaw(move[0], move[1], 0.0, 0.0) @ turned for move in free]
    return motions


def _outlines(clouds: Iterable[np.ndarray]) -> list[BaseGeometry]:
    """Return the outlines of clouds (P, 3), seen from above."""
    return [MultiPoint(cloud[:, :2]).convex_hull for cloud in clouds]


def _places(table: Table, rng: np.random.Generator) -> np.ndarray:
    """Draw places (`PLACES_TRIED`, 2) away from the edges of a table."""
    x_inset = min(INSET[0], (table.x_max - table.x_min) / 2)
    y_inset = min(INSET[1], (table.y_max - table.y_min) / 2)
    x = rng.uniform(table.x_min + x_inset, table.x_max - x_inset, PLACES_TRIED)
    y = rng.uniform(table.y_min + y_inset, table.y_max - y_inset, PLACES_TRIED)
    return np.stack((x, y), axis=1)


def _room(outline: BaseGeometry, moves: np.ndarray, others: Sequence[BaseGeometry]) -> np.ndarray:
    """Return the distance (M,) from the other outlines of an outline that is moved by each of `moves` (M, 2)."""
    moved = [translate(outline, x, y) for x, y in moves]
    return shapely.distance(np.array(moved)[:, None], np.array(others)[None]).min(axis=1, initial=np.inf)
