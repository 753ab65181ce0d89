"""Build a scene of the benchmark of goals with the simulated arm."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from agent.arm.executor import build_structure
from agent.arm.placement_rules import moving
from agent.arm.simulated_arm import SimulatedArm
from agent.evaluation.arm import record_build
from agent.pipeline.table_goal import TableGoal
from agent.pipeline.verdict import judge_goal
from structdiffusion.benchmark.goals import GoalScene
from structdiffusion.observation import Arrangement, Scene
from structdiffusion.planners.goal_planner import GoalArrangement
from structdiffusion.simulation.world import TabletopWorld

Row = dict[str, Any]


def build_goal_scene(
    scene: GoalScene, observed: Scene, arrangements: Sequence[GoalArrangement], hold: str = "friction"
) -> Row:
    """Build the first arrangement with a plan and check the result; return JSON values.

    Args:
        scene: the scene.
        observed: the observation of it.
        arrangements: best first.
        hold: how the hand holds objects, one of `agent.arm.simulated_arm.HOLDS`.

    Returns:
        "planned"; "to_place" and "placed", numbers of objects; "rank" of the arrangement that was built, from 1;
        "stands"; the failure class and the checks that failed; "trouble", a sentence for each; "seconds".
    """
    started = time.perf_counter()
    row: Row = {"planned": False, "to_place": 0, "placed": 0, "rank": None, "stands": False, "trouble": []}
    goal = scene.goal.resolved(len(scene.models))
    wanted = TableGoal(goal, tuple(scene.names), scene.world_from_initial, scene.colors or ())
    touched = sorted({*wanted.movable, *(index for one in arrangements for index in one.moved)})
    part = observed.select(touched)
    choices = [Arrangement(np.asarray(one.goal_from_initial)[touched], dict(one.scores)) for one in arrangements]
    if not choices:
        return row | {"trouble": ["no arrangement"], "seconds": round(time.perf_counter() - started, 1)}
    order = [*touched, *(i for i in range(len(scene.models)) if i not in touched)]
    rng = np.random.default_rng((scene.seed, scene.number, len(touched)))
    with TabletopWorld(scene.models, list(scene.world_from_initial), scene.table) as world:
        world.reorder(order)
        names = [scene.names[index] for index in order]
        arm = SimulatedArm(world.client)
        arm.hold_by(hold)
        work = build_structure(world, arm, part, choices, rng=rng, rules=wanted.placement_rules(part))
        rank, placed = record_build(work, row)
        motions = choices[rank].goal_from_initial
        moved = moving(motions)
        row |= {"to_place": len(moved), "placed": len(placed), "rank": rank + 1}
        if row["planned"] and placed.issuperset(moved):
            initial = scene.world_from_initial[touched]
            failure, checks = judge_goal(world, names, moved, (motions @ initial)[moved], wanted)
            failed = [check.sentence for check in checks if not check.passed]
            row |= {"stands": failure is None, "failure": failure, "failed_checks": failed}
    return row | {"seconds": round(time.perf_counter() - started, 1)}
