"""Change goals of several parts: drop parts, keep some of them, exchange objects, describe them with their numbers."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from grounding.goals.description import describe_part
from grounding.goals.goal import Goal
from grounding.goals.part_numbers import renumbered
from grounding.goals.parts import Objects, Part, PartReference, RelationPart

Names = Sequence[str]


def numbered(goal: Goal, number: int, names: Names) -> str:
    """Return a part as a conversation names it: "part 2 (circle of cup 1, cup 2, cup 3, x position right)"."""
    return f"part {number + 1} ({describe_part(goal.parts[number], names)})"


def listed(goal: Goal, names: Names) -> str:
    """Return all parts with their numbers, in one line."""
    return "; ".join(numbered(goal, number, names) for number in range(len(goal.parts)))


def objects_of(goal: Goal, objects: Objects | None) -> tuple[int, ...]:
    """Return the indices that some objects of a part are; those of the structure where another part stands for them."""
    if isinstance(objects, PartReference):
        return objects_of(goal, goal.parts[objects.part].objects)
    return tuple(one for one in objects or () if isinstance(one, int))


def references_of(part: Part) -> Objects | None:
    """Return what a part is placed by: the reference of a relation, the centre of a structure."""
    return part.reference if isinstance(part, RelationPart) else part.around


def dependants(goal: Goal, number: int) -> tuple[int, ...]:
    """Return the numbers of the relations that speak of a structure as a whole."""
    return tuple(
        other for other, part in enumerate(goal.parts)
        if isinstance(part, RelationPart) and PartReference(number) in (part.objects, part.reference)
    )  # fmt: skip


def without_parts(goal: Goal, dropped: Collection[int]) -> tuple[Goal, tuple[int, ...]]:
    """Drop parts of a goal, and with each structure the relations that speak of it as a whole.

    Returns:
        The goal, and the numbers of all parts that were dropped.
    """
    gone = {*dropped, *(each for number in dropped for each in dependants(goal, number))}
    place = {old: new for new, old in enumerate(number for number in range(len(goal.parts)) if number not in gone)}
    return Goal(tuple(renumbered(goal.parts[old], place) for old in place)), tuple(sorted(gone))


def only_parts(goal: Goal, kept: Collection[int]) -> Goal:
    """Keep some parts of a goal: where they speak of another structure as a whole, its objects take its place."""
    place = {old: new for new, old in enumerate(sorted(kept))}

    def written_out(objects: Objects | None) -> Objects | None:
        outside = isinstance(objects, PartReference) and objects.part not in place
        return objects_of(goal, objects) if outside else objects

    parts = [goal.parts[old] for old in place]
    parts = [
        replace(part, objects=written_out(part.objects), reference=written_out(part.reference))
        if isinstance(part, RelationPart) else part
        for part in parts
    ]  # fmt: skip
    return Goal(tuple(renumbered(part, place) for part in parts))


def with_part(goal: Goal, number: int, part: Part) -> Goal:
    """Put another part in the place of one."""
    return Goal((*goal.parts[:number], part, *goal.parts[number + 1 :]))


def added(goal: Goal, new: Goal) -> Goal:
    """Add the parts of another goal at the end; its references to parts are to its own."""
    place = {number: number + len(goal.parts) for number in range(len(new.parts))}
    return Goal((*goal.parts, *(renumbered(part, place) for part in new.parts)))


def exchanged(part: Part, instead: Mapping[int, int]) -> Part:
    """Put other objects in the place of some, wherever the part names them."""

    def mapped(objects: Objects | None) -> Objects | None:
        if not isinstance(objects, tuple):
            return objects
        return tuple(instead.get(one, one) for one in objects)  # type: ignore[arg-type]

    if isinstance(part, RelationPart):
        return replace(part, objects=mapped(part.objects), reference=mapped(part.reference))
    return replace(part, objects=mapped(part.objects), around=mapped(part.around))
