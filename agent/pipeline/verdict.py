"""Judge the arm's result by the checks of the evaluation protocol, on the true objects at rest."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import (
    ABNORMAL_VELOCITY,
    FINAL_SECONDS,
    MAX_DISPLACEMENT,
    MAX_TILT_DEGREES,
    NOT_UPRIGHT,
    SEMANTIC,
)
from structdiffusion.protocol.standing import standing
from structdiffusion.protocol.world_checks import semantic_checks
from structdiffusion.simulation.world import TabletopWorld
from structdiffusion.structures.checks import Check

if TYPE_CHECKING:
    from agent.pipeline.table_goal import TableGoal

STANDING = "objects that stand as placed"  # the name of the check


def judge_built(
    world: TabletopWorld,
    indices: Sequence[int],
    world_from_goal: np.ndarray,
    spec: StructureSpec,
    supports: Mapping[int, int | None] = MappingProxyType({}),
) -> tuple[str | None, tuple[Check, ...]]:
    """Wait 2 s, then check the poses of the objects and the structure.

    Args:
        world: the physics world in which the arm has built.
        indices: the N objects of the structure, as the world counts them.
        world_from_goal: (N, 4, 4) where each was to go.
        spec: the requested slots.
        supports: of an object, the one or `TABLE` that it was to rest on, where that is known.

    Returns:
        The first cause of failure, one of `structdiffusion.evaluation_protocol.FAILURE_CLASSES` or `None`, and every
        check.
    """
    world.settle(FINAL_SECONDS, until_rest=False)
    physical = _physical_checks(world, indices, world_from_goal, supports)
    return _verdict(physical, semantic_checks(world, indices, spec))


def judge_goal(
    world: TabletopWorld,
    names: Sequence[str],
    moved: Sequence[int],
    world_from_goal: np.ndarray,
    wanted: TableGoal,
    supports: Mapping[int, int | None] = MappingProxyType({}),
) -> tuple[str | None, tuple[Check, ...]]:
    """Wait 2 s, then check the poses of the moved objects and every part of the goal.

    Args:
        world: the physics world in which the arm has built.
        names: of its objects.
        moved: the M objects that were moved, as the world counts them.
        world_from_goal: (M, 4, 4) where each was to go.
        wanted: the goal.
        supports: as for `judge_built`.

    Returns: the same as `judge_built`.
    """
    from structdiffusion.protocol.goal_checks import goal_checks

    world.settle(FINAL_SECONDS, until_rest=False)
    physical = _physical_checks(world, moved, world_from_goal, supports)
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
    world: TabletopWorld, indices: Sequence[int], world_from_goal: np.ndarray, supports: Mapping[int, int | None]
) -> tuple[Check, Check, Check]:
    """Check how far objects are from their goals, how tilted, and how many stand as placed;
    without objects all hold.
    """
    pairs = zip(indices, world_from_goal, strict=True)
    ways = [standing(world, index, goal, supports.get(index)) for index, goal in pairs]
    farthest = max((way.displacement for way in ways), default=0.0)
    most = max((way.tilt for way in ways), default=0.0)
    in_place = all(way.in_place for way in ways)
    upright = all(way.upright for way in ways)
    count = sum(way.stands for way in ways)
    return (
        Check("farthest from its goal (m)", in_place, farthest, f"at most {MAX_DISPLACEMENT:g}"),
        Check("most tilted from its goal (deg)", upright, math.degrees(most), f"at most {MAX_TILT_DEGREES:g}"),
        Check(STANDING, count == len(ways), count, f"{len(ways)}"),
    )


def _verdict(physical: tuple[Check, Check, Check], semantic: Sequence[Check]) -> tuple[str | None, tuple[Check, ...]]:
    in_place, upright, standing_ones = physical
    failure = None
    if not in_place.passed:
        failure = ABNORMAL_VELOCITY
    elif not upright.passed:
        failure = NOT_UPRIGHT
    elif not all(check.passed for check in (standing_ones, *semantic)):
        failure = SEMANTIC
    return failure, (*physical, *semantic)
