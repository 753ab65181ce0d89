"""Check a goal where the camera sees the objects: the true models are not known while the arm builds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from agent.arm.remainder import Remainder
from agent.pipeline.table_goal import TableGoal
from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import estimate, imagined_bodies
from structdiffusion.protocol.goal_semantic import check_goal
from structdiffusion.protocol.semantic import check_structure
from structdiffusion.relations.figure import Standing
from structdiffusion.structures.bodies import PlacedBody
from structdiffusion.structures.checks import Check


def missed_by_structure(remainder: Remainder, spec: StructureSpec) -> list[str]:
    """Say which checks of a structure of everything that is left fail where things are, and would hold where the last
    arrangement has them.
    """
    own = [remainder.first.objects[index].name for index in remainder.left]
    every, table = range(len(own)), remainder.first.table
    return _missed(remainder, own, lambda there: check_structure(there.among(every), spec, table))


def missed_by_goal(remainder: Remainder, wanted: TableGoal) -> list[str]:
    """Say the same of a goal, or of what is left of it."""
    first, left = remainder.first.objects, set(remainder.left)
    there = {first[index].name for index in left} | {cloud.name for cloud in remainder.others}
    out = {cloud.name for index, cloud in enumerate(first) if index not in left}
    goal = wanted.without([name for name in wanted.names if name in out or name not in there])
    if goal is None:
        return []
    moved = {first[index].name for index in left if (remainder.goal_from_initial[index] != np.eye(4)).any()}
    count, aside, colors = len(goal.names), goal.set_aside(moved), goal.colors or None
    return _missed(remainder, goal.names, lambda there: check_goal(there, goal.goal, count, colors, aside))


def _missed(remainder: Remainder, names: Sequence[str], checks: Callable[[Standing], Sequence[Check]]) -> list[str]:
    """Describe the checks that fail where things are, and hold where the last arrangement has them.

    What fails at both places is an error of the estimated outlines, which no motion of the arm can mend.

    Args:
        remainder: what is left of a build.
        names: of the objects that come first in what is checked; all others follow.
        checks: the checks of what stands on the table.
    """
    first = remainder.first
    clouds = {first.objects[index].name: first.objects[index] for index in remainder.left}
    motions = {
        first.objects[index].name: (remainder.now_from_initial[index], remainder.goal_from_initial[index])
        for index in remainder.left
    }
    for cloud in remainder.others:
        clouds[cloud.name], motions[cloud.name] = cloud, (np.eye(4), np.eye(4))
    order = [*names, *(name for name in clouds if name not in names)]
    estimates = [estimate(clouds[name].on_the_table()) for name in order]
    raised = np.tile(np.eye(4), (len(order), 1, 1))
    raised[:, 2, 3] = [clouds[name].bottom for name in order]
    now, goal = (np.array([motions[name][k] for name in order]) @ raised for k in range(2))
    before = np.array([body.centroid for body in imagined_bodies(estimates, raised)])
    there = imagined_bodies(estimates, goal)
    # What each rests on is watched by itself, and a few millimetres of height must not change it here.
    here = [replace(body, rests_on=at.rests_on) for body, at in zip(imagined_bodies(estimates, now), there)]

    def result(bodies: Sequence[PlacedBody]) -> list[Check]:
        return list(checks(Standing(tuple(bodies), before, ((),) * len(order), first.table)))

    held = {check.name for check in result(there) if check.passed}
    return [check.sentence for check in result(here) if not check.passed and check.name in held]
