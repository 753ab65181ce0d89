"""Select the first of the ranked arrangements with a plan for every object."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator, Sequence

import numpy as np

from agent.arm.events import ArmEvent, PlanFailed, Planned
from agent.arm.kinematics import Kinematics
from agent.arm.motion_planner import PlanningScene
from agent.arm.object_planner import ObjectPlan
from agent.arm.placement_order import bottom_at
from agent.arm.placement_rules import PlacementRules
from agent.arm.task_planner import Search
from structdiffusion.completion.surface import completed_scene
from structdiffusion.footprints import LEAST_STEP
from structdiffusion.observation import Arrangement, Scene

# Configurations that are checked, not seconds, so that the same seed ends the same way however busy the machine is: a
# quiet one takes about a minute.
PLANNING_CHECKS = 300_000


def plan_structure(
    scene: Scene,
    arrangements: Sequence[Arrangement],
    *,
    rng: np.random.Generator,
    planning_checks: int = PLANNING_CHECKS,
    kinematics: Kinematics = Kinematics(),
    rules: PlacementRules = PlacementRules(),
    hold: str = "friction",
) -> Iterator[ArmEvent]:
    """Find the first arrangement with a plan for every object, without moving anything.

    With the same `rng` this is the plan that `agent.arm.executor.build_structure` carries out.

    Yields:
        `PlanFailed` for every arrangement without a plan, and `Planned` for the first that has one.
    """
    with PlanningScene(rng.spawn(1)[0], kinematics) as planning:
        planning.arm.hold_by(hold)
        search = Search(planning, rng, scene.table, rules)
        yield from find_plan(search, completed_scene(scene), arrangements, planning_checks)


def find_plan(
    search: Search, scene: Scene, arrangements: Sequence[Arrangement], planning_checks: int
) -> Generator[ArmEvent, None, tuple[int, list[ObjectPlan]] | None]:
    """Yield the events of planning; return the place of the first arrangement with a plan, and the plan, or `None`.

    Args:
        search: the planner.
        scene: with the hidden sides of its objects (`completed_scene`).
        arrangements: best first.
        planning_checks: the most configurations that may be checked.
    """
    began = time.monotonic()
    clouds = [np.asarray(cloud.points, dtype=np.float64) for cloud in scene.objects]
    bottoms = [cloud.bottom for cloud in scene.objects]
    distractors = [np.asarray(cloud.points, dtype=np.float64) for cloud in scene.distractors]
    # Where no arrangement has a plan, all are tried again with objects set down on the way and touched lightly.
    rules = search.rules  # what is planned again has no order of its own, and keeps that of the arrangement chosen here
    for last_resort in (False, True):
        search.loosen(last_resort)
        try:
            for rank, arrangement in enumerate(arrangements):
                search.rules = rules.in_order(_lifted(arrangement, clouds, bottoms))
                plans, blocked, reason = search.arrangement(
                    clouds, distractors, arrangement.goal_from_initial, planning_checks, bottoms, stop_over=last_resort
                )
                if not reason:
                    order, grasps = tuple(plan.object for plan in plans), tuple(plan.grasp.kind for plan in plans)
                    yield Planned(rank, order, grasps, time.monotonic() - began)
                    return rank, plans
                if not last_resort:  # the events name what stands in the way of each arrangement once
                    yield PlanFailed(rank, blocked, "" if blocked is None else scene.objects[blocked].name, reason)
                if search.scene.checks > planning_checks:
                    return None
        finally:
            search.loosen(False)
    return None


def _lifted(arrangement: Arrangement, clouds: Sequence[np.ndarray], bottoms: Sequence[float]) -> list[int]:
    """Return the order of an arrangement without what stands on the table, which stands whatever else does."""
    return [
        i for i in arrangement.order if bottom_at(arrangement.goal_from_initial[i], clouds[i], bottoms[i]) > LEAST_STEP
    ]
