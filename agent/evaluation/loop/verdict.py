"""Judge on the true objects what a disturbed build has come to, against the goal or what is left of it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

from agent.pipeline.table_goal import renumbered
from grounding.goals.goal import Goal
from grounding.goals.parts import Objects, Part, PartReference, RelationPart, StructurePart
from grounding.structure_words import words_of
from structdiffusion.benchmark.goals import GoalScene
from structdiffusion.evaluation_protocol import MAX_TILT, MAX_TILT_DEGREES
from structdiffusion.geometry import tilt_between
from structdiffusion.protocol.goal_checks import goal_checks
from structdiffusion.simulation.world import FALLEN, TabletopWorld


def failed_checks(
    world: TabletopWorld,
    scene: GoalScene,
    order: Sequence[int],
    moved: Collection[int],
    gone: Collection[int] = (),
) -> list[str]:
    """Check a world at rest; return what fails, a line each.

    Args:
        world: the world in which was built.
        scene: the scene and its goal.
        order: the scene's objects as the world counts them.
        moved: the scene's objects that the arm has moved.
        gone: objects without which the goal has to hold.
    """
    everything = range(len(scene.models))
    whole = scene.goal.resolved(len(everything))
    left = [index for index in everything if index not in gone]
    failed = []
    for index in sorted({*_placed_by(whole), *moved} - set(gone)):
        pose = world.pose(order.index(index))
        if pose[2, 3] < FALLEN:
            failed.append(f"{scene.names[index]}: not on the table")
        elif (tilt := tilt_between(pose, scene.world_from_initial[index])) > MAX_TILT:
            failed.append(f"{scene.names[index]}: tilted by {tilt:.3g} rad, allowed {MAX_TILT_DEGREES:g} degrees")
    goal = goal_without(whole, gone)
    if goal.parts:
        named, place = set(goal.named_objects()), {index: number for number, index in enumerate(left)}
        checks = goal_checks(
            world,
            [order.index(index) for index in left],
            renumbered(goal, place),
            scene.world_from_initial[left],
            [scene.names[index] for index in left],
            # What is left of a part that is no more, or made room, stands somewhere on the table.
            aside=[place[index] for index in left if index in moved and index not in named],
            colors=None if scene.colors is None else [scene.colors[index] for index in left],
        )
        failed += [check.sentence for check in checks if not check.passed]
    return failed


def goal_without(goal: Goal, gone: Collection[int]) -> Goal:
    """Return what is left of a goal without some of its objects.

    Structures go on with their other objects. Structures that have too few of them, and relations to what is gone, are
    left out.
    """
    kept: dict[int, Part] = {}
    for number, part in enumerate(goal.parts):
        if isinstance(part, StructurePart):
            left: Any = tuple(index for index in part.objects or () if index not in gone)
            least = 1 if part.shape is None else words_of(part.shape).least
            if len(left) >= least and not set(part.around or ()) & set(gone):
                kept[number] = replace(part, objects=left)
    numbers = {old: new for new, old in enumerate(kept)}
    kept |= {
        number: part
        for number, part in enumerate(goal.parts)
        if isinstance(part, RelationPart)
        and all(_whole(objects, gone, numbers) for objects in (part.objects, part.reference))
    }
    numbers = {old: new for new, old in enumerate(sorted(kept))}

    def referred(objects: Any) -> Any:
        return PartReference(numbers[objects.part]) if isinstance(objects, PartReference) else objects

    return Goal(tuple(
        replace(part, objects=referred(part.objects), reference=referred(part.reference))
        if isinstance(part, RelationPart)
        else part
        for _, part in sorted(kept.items())
    ))  # fmt: skip


def _whole(objects: Objects | None, gone: Collection[int], structures: Collection[int]) -> bool:
    """Return whether nothing is gone of what a relation is about, and a structure that it is about is still one."""
    if isinstance(objects, PartReference):
        return objects.part in structures
    return not set(objects or ()) & set(gone)


def _placed_by(goal: Goal) -> set[int]:
    return {index for part in goal.parts if isinstance(part.objects, tuple) for index in part.objects}  # type: ignore[misc]
