"""Set aside what stands or lies where something has to go, whatever it is, as it is."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from shapely import MultiPoint

from agent.arm.eyes import Eyes
from agent.arm.grasps import Grasp
from agent.arm.object_planner import ObjectPlan
from agent.arm.placement_order import GOAL_CLEARANCE, way_aside
from agent.arm.task_planner import Search
from structdiffusion.completion.surface import completed_points
from structdiffusion.footprints import LEAST_OVERLAP
from structdiffusion.observation import ObjectCloud

SOMETHING = "something"  # what no known object explains
TOP = 98  # percentile of heights: a few points of noise are higher


@dataclass(frozen=True, eq=False)
class Obstruction:
    """Something in the way of a placement.

    Attributes:
        index: of the object or, from the number of objects on, of the distractor; `None` for something unknown.
        name: its name.
        cloud: (P, 3) its points now, with its hidden sides, world frame, metres.
        bottom: z of what it stands on.
    """

    index: int | None
    name: str
    cloud: np.ndarray
    bottom: float

    @property
    def detail(self) -> str:
        """Say where it is."""
        x, y = self.cloud[:, :2].mean(axis=0)
        return f"in the way at ({x:.2f}, {y:.2f})"


def in_the_way(cloud: np.ndarray, goals: Iterable[np.ndarray]) -> bool:
    """Return whether a cloud (P, 3) takes the place of any of the clouds (P, 3) that are to be somewhere."""
    taken, top = MultiPoint(cloud[:, :2]).convex_hull, np.percentile(cloud[:, 2], TOP)
    return any(
        goal[:, 2].min() < top and MultiPoint(goal[:, :2]).convex_hull.distance(taken) < GOAL_CLEARANCE
        for goal in goals
    )


def obstructions(eyes: Eyes, idle: Iterable[int], goals: Sequence[np.ndarray]) -> list[Obstruction]:
    """Return what is in the way, what nothing else of it stands on first.

    Args:
        eyes: what is known of where everything is.
        idle: the objects and distractors that have no place in the structure.
        goals: (P, 3) clouds of what is to be placed, at its goal.
    """
    found = [
        Obstruction(k, eyes.names[k], eyes.solid(k), eyes.bottom(k)) for k in idle if in_the_way(eyes.cloud(k), goals)
    ]
    for cloud in eyes.unknown:
        if in_the_way(cloud, goals):
            bottom = _bottom_below(cloud, [eyes.cloud(k) for k in range(len(eyes.names)) if k not in eyes.gone])
            seen = ObjectCloud(SOMETHING, "object", cloud.astype(np.float32), bottom=bottom)
            found.append(Obstruction(None, SOMETHING, completed_points(seen, eyes.scene.world_from_camera), bottom))
    return sorted(found, key=lambda one: -one.bottom)


def _bottom_below(cloud: np.ndarray, others: Sequence[np.ndarray]) -> float:
    """Return z of the highest of the other clouds (P, 3) that a cloud (P, 3) may stand on, or 0, the table."""
    outline, low = MultiPoint(cloud[:, :2]).convex_hull, float(np.percentile(cloud[:, 2], 100 - TOP))
    tops = [
        top
        for other in others
        if MultiPoint(other[:, :2]).convex_hull.intersection(outline).area > LEAST_OVERLAP
        and (top := float(np.percentile(other[:, 2], TOP))) < low + GOAL_CLEARANCE
    ]
    return max(tops, default=0.0)


def plan_aside(
    eyes: Eyes, search: Search, thing: Obstruction, goals: Sequence[np.ndarray], failed: Sequence[Grasp], limit: int
) -> tuple[ObjectPlan | None, str]:
    """Return a plan to set something aside as it stands or lies, on the table, or `None` and the reason.

    Args:
        eyes: what is known of where everything is.
        search: plans the motions.
        thing: what is in the way.
        goals: (P, 3) clouds of what is to be placed, at its goal.
        failed: grasps that failed.
        limit: the most configurations that may be checked.
    """
    now = eyes.scene_now(solid=True)
    clouds = [np.asarray(one.points, dtype=np.float64) for one in now.objects]
    bottoms = [one.bottom for one in now.objects]
    others = [np.asarray(one.points, dtype=np.float64) for one in now.distractors]
    index = thing.index
    if index is None or index >= eyes.count:
        middle = thing.cloud.mean(axis=0)
        itself = min(range(len(others)), key=lambda k: float(np.linalg.norm(others[k].mean(axis=0) - middle)))
        del others[itself]
        index = len(clouds)
        clouds.append(thing.cloud)
        bottoms.append(thing.bottom)
    keep_off = [MultiPoint(one[:, :2]).convex_hull for k, one in enumerate([*clouds, *others, *goals]) if k != index]
    outline = MultiPoint(thing.cloud[:, :2]).convex_hull
    middle = thing.cloud[:, :2].mean(axis=0)
    motion = way_aside(outline, middle, thing.bottom, keep_off, eyes.scene.table, search.rng)
    if motion is None:
        return None, "there is no free place for it"
    most = search.scene.checks + limit
    plan, reason = search.object_at_last(index, clouds, others, bottoms, motion, most, None, failed)
    return (None, reason) if plan is None else (replace(plan, aside=True), "")
