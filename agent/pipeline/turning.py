"""Turn a build to another goal while the arm builds: around what stands, and with what stays as it was asked for."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

import numpy as np

from agent import events
from agent.arm.placement_order import bottom_at
from agent.arm.remainder import Remainder
from agent.pipeline.laying_out import GoalLayouts, layouts_of
from agent.pipeline.table_goal import TableGoal
from grounding.goals.part_numbers import still_to_build
from grounding.goals.parts import Part, PartReference, RelationPart
from grounding.spec import StructureSpec
from structdiffusion.geometry import transform_points
from structdiffusion.observation import Arrangement, ObjectCloud, Scene

Propose = Callable[[Scene, "StructureSpec | TableGoal"], events.Proposed]


def carried_over(remainder: Remainder, now: Scene) -> Remainder:
    """Return what is left of a build as the beginning of another one.

    Args:
        remainder: of the build that has ended.
        now: the table as it was seen since: the objects that take part from now on, and all others as distractors.

    Returns:
        What is left, of the objects of `now` and after them of those that took part before and do so no more.
    """
    place = {cloud.name: index for index, cloud in enumerate(remainder.first.objects)}
    dropped = [cloud for cloud in now.distractors if cloud.name in place]
    every = (*now.objects, *dropped)
    goals = [
        remainder.goal_from_initial[place[cloud.name]] @ np.linalg.inv(remainder.now_from_initial[place[cloud.name]])
        if cloud.name in place
        else np.eye(4)
        for cloud in every
    ]
    taking = range(len(now.objects))
    standing = frozenset(index for index in taking if place.get(every[index].name) in remainder.standing)
    first = replace(now, objects=every, distractors=())
    motionless = np.tile(np.eye(4), (len(every), 1, 1))
    return Remainder(first, now.distractors, tuple(taking), motionless, np.array(goals), standing)


def laid_around(
    wanted: StructureSpec | TableGoal, left: Remainder, before: Collection[str], propose: Propose
) -> list[Arrangement]:
    """Propose arrangements of a goal around what stands of a build that ends for it, best first.

    Parts that were asked for before keep their places, whether they stand already or not, where the others find room
    beside them.

    Args:
        wanted: the goal.
        left: what is left of that build, as `carried_over` returns it.
        before: a line for each part of its goal, as in `TableGoal.sentences`.
        propose: as for `layouts_of`.

    Returns:
        Arrangements of the objects that take part from now on.
    """
    found = _beside_the_others(wanted, left, before, propose) if isinstance(wanted, TableGoal) else []
    found += layouts_of(wanted, propose, another=True).lay_out(left)
    return [Arrangement(each.goal_from_initial[list(left.left)], each.scores) for each in found]


def _beside_the_others(
    wanted: TableGoal, left: Remainder, before: Collection[str], propose: Propose
) -> list[Arrangement]:
    """Lay out the parts that are new or other than before, beside the others in the places of the last arrangement."""
    place = {cloud.name: index for index, cloud in enumerate(left.first.objects)}
    kept = kept_parts(wanted, before, [left.first.objects[index].name for index in left.left])
    stay = sorted({place[wanted.names[one]] for number in kept for one in wanted.goal.parts[number].objects or ()})  # type: ignore[union-attr, index]
    if not stay:
        return []
    goals = left.goal_from_initial.copy()
    goals[list(left.standing)] = np.eye(4)
    clouds = list(left.first.objects)
    for index in stay:
        clouds[index] = _moved(clouds[index], goals[index])
    beside = np.where(np.isin(np.arange(len(clouds)), stay)[:, None, None], np.eye(4), left.goal_from_initial)
    there = replace(
        left,
        first=replace(left.first, objects=tuple(clouds)),
        goal_from_initial=beside,
        standing=left.standing | set(stay),
    )
    rest = replace(wanted, goal=still_to_build(wanted.goal, kept))
    found = GoalLayouts(rest, propose, another=True).lay_out(there)
    found = [each for each in found if np.allclose(each.goal_from_initial[stay], np.eye(4))]
    for each in found:
        each.goal_from_initial[stay] = goals[stay]
    return found


def kept_parts(wanted: TableGoal, before: Collection[str], known: Sequence[str]) -> set[int]:
    """Return the numbers of the parts of a goal that were asked for before, and speak of nothing that goes elsewhere.

    Args:
        wanted: the goal.
        before: a line for each part that was asked for before.
        known: the names of the objects whose places are known.
    """
    parts, names = wanted.goal.parts, wanted.names
    kept = {
        number
        for number, line in enumerate(wanted.sentences)
        if line in before and all(names[one] in known for one in _listed(parts[number]))
    }
    while True:
        goes = {one for number, part in enumerate(parts) if number not in kept for one in _listed(part)}
        lost = {number for number in kept if not _is_free_of(parts[number], kept, goes)}
        if not lost:
            return kept
        kept -= lost


def _is_free_of(part: Part, kept: Collection[int], goes: Collection[int]) -> bool:
    """Return whether a part speaks of no part that is not kept, and of no object that goes elsewhere."""
    second = part.reference if isinstance(part, RelationPart) else part.around
    return not any(
        objects.part not in kept if isinstance(objects, PartReference) else set(objects or ()) & set(goes)
        for objects in (part.objects, second)
    )


def _listed(part: Part) -> tuple[int, ...]:
    return part.objects if isinstance(part.objects, tuple) else ()  # type: ignore[return-value]


def _moved(cloud: ObjectCloud, motion: np.ndarray) -> ObjectCloud:
    points = cloud.points.astype(np.float64)
    bottom = max(0.0, bottom_at(motion, points, cloud.bottom))
    return replace(cloud, points=transform_points(motion, points).astype(np.float32), bottom=bottom)
