"""Judge the arm's result by the checks of the evaluation protocol, on the true objects at rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import FINAL_SECONDS, MAX_DISPLACEMENT, MAX_TILT, MAX_TILT_DEGREES
from structdiffusion.geometry import tilt_between
from structdiffusion.protocol.world_checks import semantic_checks
from structdiffusion.simulation.world import TabletopWorld
from structdiffusion.structures.checks import Check

if TYPE_CHECKING:
    from agent.pipeline.table_goal import TableGoal


def judge_built(
    world: TabletopWorld, indices: Sequence[int], world_from_goal: np.ndarray, spec: StructureSpec
) -> tuple[str | None, tuple[Check, ...]]:
    """Wait 2 s, then check the poses of the objects and the structure.

    Args:
        world: the physics world in which the arm has built.
        indices: the N objects of the structure, as the world counts them.
        world_from_goal: (N, 4, 4) where each was to go.
        spec: the requested slots.

    Returns:
        The first cause of failure, one of `structdiffusion.protocol.semantic.FAILURE_CLASSES` or `None`, and every
        check.
    """
    world.settle(FINAL_SECONDS, until_rest=False)
    physical = _physical_checks(world, indices, world_from_goal)
    return _verdict(physical, semantic_checks(world, indices, spec))


def judge_goal(
    world: TabletopWorld, names: Sequence[str], moved: Sequence[int], world_from_goal: np.ndarray, wanted: TableGoal
) -> tuple[str | None, tuple[Check, ...]]:
    """Wait 2 s, then check the poses of the moved objects and every part of the goal.

    Args:
        world: the physics world in which the arm has built.
        names: of its objects.
        moved: the M objects that were moved, as the world counts them.
        world_from_goal: (M, 4, 4) where each was to go.
        wanted: the goal.

    Returns: the same as `judge_built`.
    """
    from structdiffusion.protocol.goal_checks import goal_checks

    world.settle(FINAL_SECONDS, until_rest=False)
    physical = _physical_checks(world, moved, world_from_goal)
    checks = goal_checks(
        world,
        [names.index(name) for name in wanted.all_names],
        wanted.goal,
        wanted.all_initial,
        wanted.all_names,
        count=len(wanted.names),
        aside=wanted.set_aside([names[index] for index in moved]),
        colors=wanted.colors,
    )
    return _verdict(physical, checks)


def _physical_checks(
    world: TabletopWorld, indices: Sequence[int], world_from_goal: np.ndarray
) -> tuple[Check, Check]:
    """Check how far objects are from their goals, and how tilted; without objects both hold."""
    poses = world.poses()
    pairs = [(poses[index], goal) for index, goal in zip(indices, world_from_goal, strict=True)]
    displacement = max((float(np.linalg.norm(pose[:2, 3] - goal[:2, 3])) for pose, goal in pairs), default=0.0)
    tilt = max((tilt_between(pose, goal) for pose, goal in pairs), default=0.0)
    limit = f"at most {MAX_DISPLACEMENT:g}"
    in_place = Check("farthest from its goal (m)", displacement <= MAX_DISPLACEMENT, displacement, limit)
    limit = f"at most {MAX_TILT_DEGREES:g}"
    return in_place, Check("most tilted from its goal (deg)", tilt <= MAX_TILT, math.degrees(tilt), limit)


def _verdict(
    physical: tuple[Check, Check], semantic: Sequence[Check]
) -> tuple[str | None, tuple[Check, ...]]:
    in_place, upright = physical
    failure = None
    if not in_place.passed:
        failure = "abnormal velocity"
    elif not upright.passed:
        failure = "not upright"
    elif not all(check.passed for check in semantic):
        failure = "semantic"
    return failure, (in_place, upright, *semantic)
