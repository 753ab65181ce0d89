"""Exchange the places of two parts, or of two objects, of a goal: "swap them", "swap the cups"."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from grounding.edits.parts import CannotEdit
from grounding.goals.goal import Goal
from grounding.goals.parts import (
    DIRECTIONAL,
    Order,
    Part,
    PartReference,
    RelationPart,
    StructurePart,
    order_starts,
    takes_key,
)


def swapped(goal: Goal, named: Sequence[int], targets: Sequence[int] | None, stood: bool) -> Goal | None:
    """Exchange two places.

    Args:
        goal: the goal.
        named: the objects that are named.
        targets: the parts that are named; `None` where none is.
        stood: whether all of the goal is built.

    Returns:
        The goal; `None` where other objects are named than it has.

    Raises:
        CannotEdit: where it is not clear which two places are meant.
    """
    parts = tuple(range(len(goal.parts))) if targets is None else tuple(targets)
    if len(named) == 2 and not _are_whole_parts(goal, named, parts):
        return _objects_exchanged(goal, named[0], named[1], stood)
    if len(parts) == 1:
        return _within(goal, parts[0], stood)
    if len(parts) == 2:
        one, other = (goal.parts[number] for number in parts)
        if (places := _places_exchanged(one, other)) is not None:
            instead = dict(zip(parts, places, strict=True))
            return Goal(tuple(instead.get(number, part) for number, part in enumerate(goal.parts)))
    raise CannotEdit(
        "it is not clear which two places should be exchanged; name both, for example 'swap the cup and the can'"
    )


def _are_whole_parts(goal: Goal, named: Sequence[int], parts: Sequence[int]) -> bool:
    return len(parts) == 2 and all(
        goal.parts[number].objects == (index,) for number, index in zip(parts, named, strict=True)
    )


def _within(goal: Goal, number: int, stood: bool) -> Goal:
    """Exchange the two that a part names, or the two objects of a structure."""
    part = goal.parts[number]
    if isinstance(part, RelationPart):
        turned = part.relation in (*DIRECTIONAL, "on", "in")
        if not (turned and isinstance(part.objects, tuple) and isinstance(part.reference, tuple)):
            raise CannotEdit(f"{part.relation!r} does not have two places to exchange")
        new: Part = replace(part, objects=part.reference, reference=part.objects)
        return Goal((*goal.parts[:number], new, *goal.parts[number + 1 :]))
    if isinstance(part.objects, tuple) and len(part.objects) == 2:
        one, other = part.objects
        return _objects_exchanged(goal, one, other, stood)
    raise CannotEdit("it is not clear which two should be exchanged; name both, for example 'swap the cup and the can'")


def _objects_exchanged(goal: Goal, one: int | str, other: int | str, stood: bool) -> Goal:
    """Exchange two objects wherever the goal names them; in a structure without an order, where they stand."""
    instead = {one: other, other: one}
    parts = tuple(_renamed(part, instead) for part in goal.parts)
    if Goal(parts).canonical() != goal.canonical():
        return Goal(parts)
    if stood:
        return Goal((*goal.parts, RelationPart("swapped", (one, other))))
    for number, part in enumerate(parts):
        if isinstance(part, StructurePart) and _in_layers(part) and set(part.objects or ()) >= {one, other}:
            # Without an order they stand as they are listed; the speaker has seen a proposal with these two the other
            # way.
            new = replace(part, order=Order("listed", None, "bottom"))
            return Goal((*parts[:number], new, *parts[number + 1 :]))
    raise CannotEdit("you have not given an order, so these two have no fixed places; say which order you want")


def _in_layers(part: StructurePart) -> bool:
    """Return whether the objects of a structure stand one on another, in an order that can be asked for."""
    return takes_key(part.shape, "order") and "bottom" in order_starts(part.shape)


def _renamed(part: Part, instead: Mapping[int | str, int | str]) -> Part:
    def mapped(objects: Any) -> Any:
        return tuple(instead.get(each, each) for each in objects) if isinstance(objects, tuple) else objects

    if isinstance(part, RelationPart):
        return replace(part, objects=mapped(part.objects), reference=mapped(part.reference))
    return replace(part, objects=mapped(part.objects), around=mapped(part.around))


def _places_exchanged(one: Part, other: Part) -> tuple[Part, Part] | None:
    """Exchange where two parts are: on the table, or beside the same thing; `None` where they are nowhere alike."""
    places: list[dict[str, Any]] = [
        {key: getattr(part, key, None) for key in ("x_position", "y_position")} for part in (one, other)
    ]
    if all(any(place.values()) for place in places) and places[0] != places[1]:
        return replace(one, **places[1]), replace(other, **places[0])
    if not (isinstance(one, RelationPart) and isinstance(other, RelationPart)):
        return None
    if one.relation == other.relation and one.reference == other.reference:
        return None
    if {one.relation, other.relation} & {"at", "moved", "swapped"} or isinstance(one.objects, PartReference):
        return None
    if one.reference == other.objects or other.reference == one.objects:
        return None
    return replace(one, objects=other.objects), replace(other, objects=one.objects)
