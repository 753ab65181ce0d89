"""Order the moves of an arrangement so that each goal is free when its object comes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import MultiPoint, Polygon
from shapely.affinity import translate

from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.observation import Table

GAP = 0.005  # m that is kept clear around what is not moved yet
_LOWER = 0.01  # m: a goal that is lower by more comes first
_GRID = 0.02  # m between the places that are tried for what is set aside


def ordered_moves(
    clouds: Sequence[np.ndarray], goal_from_initial: np.ndarray, others: Sequence[np.ndarray], table: Table
) -> list[tuple[int, np.ndarray]]:
    """Return the moves that bring N objects to their goals, one after the other: (index, motion (4, 4) from now).

    Where objects stand in each other's goals, one of them is set aside first. Where nothing helps, the rest
    comes in the order of its heights.

    Args:
        clouds: (P, 3) of each object as it stands, world frame, metres; its hidden sides included.
        goal_from_initial: (N, 4, 4) their motions.
        others: (P, 3) of each thing that stays.
        table: the table top.
    """
    now = [MultiPoint(points[:, :2]).convex_hull for points in clouds]
    goals = [transform_points(motion, points) for motion, points in zip(goal_from_initial, clouds, strict=True)]
    there = [MultiPoint(points[:, :2]).convex_hull for points in goals]
    heights = [float(points[:, 2].min()) for points in goals]
    aside = [np.eye(4) for _ in clouds]
    still = [MultiPoint(points[:, :2]).convex_hull for points in others]
    left = sorted(range(len(clouds)), key=lambda index: (round(heights[index] / _LOWER), -there[index].area))
    moves: list[tuple[int, np.ndarray]] = []
    parked: set[int] = set()
    while left:
        carried = [
            index
            for index in left
            if not any(heights[j] < heights[index] - _LOWER and there[j].intersects(there[index]) for j in left)
        ]
        free = [i for i in carried if all(now[j].distance(there[i]) > GAP for j in left if j != i)]
        if not free:
            blockers = [j for j in left if j not in parked and now[j].distance(there[carried[0]]) <= GAP]
            blockers = [j for j in blockers if j != carried[0]]
            way = _way_aside(now[blockers[0]], [*still, *there, *now], table) if blockers else None
            if way is not None:
                index = blockers[0]
                aside[index], now[index] = pose_from_xyz_yaw(*way, 0.0, 0.0), translate(now[index], *way)
                moves.append((index, aside[index]))
                parked.add(index)
                continue
        index = (free or carried)[0]
        moves.append((index, goal_from_initial[index] @ np.linalg.inv(aside[index])))
        left.remove(index)
    return moves


def _way_aside(outline: Polygon, standing: Sequence[Polygon], table: Table) -> tuple[float, float] | None:
    """Return the shortest way (x, y), metres, by which an outline comes clear of all others on the table, or `None`."""
    x_min, y_min, x_max, y_max = outline.bounds
    xs = np.arange(table.x_min + GAP - x_min, table.x_max - GAP - x_max, _GRID)
    ys = np.arange(table.y_min + GAP - y_min, table.y_max - GAP - y_max, _GRID)
    taken = shapely.unary_union([one.buffer(GAP) for one in standing if one is not outline])
    ways = sorted(((float(x), float(y)) for x in xs for y in ys), key=lambda way: float(np.hypot(*way)))
    return next((way for way in ways if not translate(outline, *way).intersects(taken)), None)
