"""Plan one scene of the goal benchmark, and check the proposals in physics."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import torch

from agent.arm.arm_model import DEFAULT_MODEL, arm_model
from agent.arm.fixed_objects import with_fixed
from agent.event_base import json_value
from grounding.goals.description import describe_parts
from grounding.goals.parts import StructurePart
from grounding.spec import SpecError
from structdiffusion.benchmark.goals import GoalScene
from structdiffusion.benchmark.success import NO_ARRANGEMENT
from structdiffusion.evaluation_protocol import SEMANTIC
from structdiffusion.observation import Scene
from structdiffusion.planners.goal_planner import GoalArrangement, GoalPlanner
from structdiffusion.protocol.physical_stability import Verdict
from structdiffusion.structures.structure import LayoutError

Row = dict[str, Any]
DISTURBED = "disturbed reference"  # stands for a planner in the tables
DISTURBED_BY = 0.04  # m


def solve_goal_scene(
    planner: GoalPlanner, scene: GoalScene, candidates: int
) -> tuple[Row, Scene, list[GoalArrangement]]:
    """Let a planner solve one scene; scene and planner determine everything but the times.

    Args:
        planner: the planner to measure.
        scene: the scene.
        candidates: the number of arrangements that it proposes; the best-ranked one is tried.

    Returns:
        The row without the planner's name, JSON-ready; the observation; and the arrangements, best first.
    """
    looked = time.perf_counter()
    observed = scene.observed()
    started = time.perf_counter()
    arrangements, problem = proposals_of(planner, scene, observed, candidates)
    planned = time.perf_counter()
    best = arrangements[0] if arrangements else None
    verdict = None if best is None else scene.verdict(best.goal_from_initial, best.aside)
    row = scene_row(scene) | {
        "success": verdict is not None and verdict.success,
        "failure": NO_ARRANGEMENT if verdict is None else verdict.failure,
        "failed_parts": [] if verdict is None else failed_parts(scene, verdict),
        "detail": problem if verdict is None else verdict.detail,
        "proposed": len(arrangements),
        "moved": [] if best is None else list(best.moved),
        "aside": [] if best is None else list(best.aside),
        "rivals": rival_verdicts(scene, verdict),
        "plan_seconds": round(planned - started, 3),
        "seconds": round(time.perf_counter() - looked, 3),
        "verdict": None if verdict is None else verdict.to_dict(),
    }
    return json_value(row), observed, arrangements


def proposals_of(
    planner: GoalPlanner, scene: GoalScene, observed: Scene, candidates: int
) -> tuple[list[GoalArrangement], str | None]:
    """Return a planner's arrangements for a scene as it was observed, best first; or none, and why."""
    generator = torch.Generator().manual_seed(scene.planning_seed)
    try:
        return planner.propose(observed, scene.goal, count=candidates, generator=generator, colors=scene.colors), None
    except (LayoutError, SpecError) as error:
        return [], str(error)


def liftable_proposals(
    planner: GoalPlanner,
    scene: GoalScene,
    observed: Scene,
    arrangements: list[GoalArrangement],
    candidates: int,
    hold: str,
) -> list[GoalArrangement]:
    """Return arrangements that leave where it is what no grasp fits; those given, if the hand can lift everything."""
    liftable = with_fixed(observed, arm_model(DEFAULT_MODEL).hand, hold)
    return proposals_of(planner, scene, liftable, candidates)[0] if liftable.fixed else arrangements


def judge_disturbed(scene: GoalScene) -> Row:
    """Judge the reference arrangement with every moved object put `DISTURBED_BY` off, in a random direction.

    It shows how strict our checks and the rivals' are, because these arrangements are close to the goal but miss it.
    """
    started = time.perf_counter()
    rng = np.random.default_rng(scene.planning_seed)
    motions = np.array(scene.reference)
    moved = np.flatnonzero((motions != np.eye(4)).any(axis=(1, 2)))
    angles = rng.uniform(-np.pi, np.pi, len(moved))
    motions[moved, :2, 3] += DISTURBED_BY * np.column_stack((np.cos(angles), np.sin(angles)))
    verdict = scene.verdict(motions)
    row = scene_row(scene) | {
        "success": verdict.success,
        "failure": verdict.failure,
        "failed_parts": failed_parts(scene, verdict),
        "detail": verdict.detail,
        "proposed": 1,
        "moved": moved.tolist(),
        "aside": [],
        "rivals": rival_verdicts(scene, verdict),
        "plan_seconds": 0.0,
        "seconds": round(time.perf_counter() - started, 3),
        "verdict": verdict.to_dict(),
    }
    return json_value(row)


def scene_row(scene: GoalScene) -> Row:
    """Return the keys of a row that describe its scene."""
    names = scene.names
    return {
        "family": scene.family,
        "kind": scene.kind,
        "number": scene.number,
        "seed": scene.seed,
        "draw": scene.draw,
        "goal": scene.goal.to_dict(),
        "words": describe_parts(scene.goal.parts, names),
        "objects": [model.name for model in scene.models],
    }


def failed_parts(scene: GoalScene, verdict: Verdict) -> list[str]:
    """Name the parts whose checks failed: by their shape or relation, once each.

    Of several parts, checks begin with the name of theirs.
    """
    failed: list[str] = []
    for check in verdict.checks:
        if not check.passed:
            name, colon, _ = check.name.partition(": ")
            failed.append(_sort_of(scene, name if colon else ""))
    return list(dict.fromkeys(failed))


def _sort_of(scene: GoalScene, name: str) -> str:
    """Return the shape or relation of the part that a check's name begins with."""
    parts = scene.goal.parts
    sorts = [part.shape or "structure" if isinstance(part, StructurePart) else part.relation for part in parts]
    if len(parts) == 1:
        return sorts[0]
    return next((sort for sort in sorts if sort in name), name or "what is not named")


def rival_verdicts(scene: GoalScene, verdict: Verdict | None) -> dict[str, bool | None]:
    """Return the verdicts of the rivals' checks on the final poses; `None` for a rival that cannot check the goal.

    What fails physically, or was never proposed, has failed for them too.
    """
    if verdict is not None and verdict.failure in (None, SEMANTIC) and verdict.world_from_final is not None:
        return scene.rival_verdicts(np.asarray(verdict.world_from_final))
    known = scene.rival_verdicts(scene.world_from_initial)
    return {name: None if accepts is None else False for name, accepts in known.items()}
