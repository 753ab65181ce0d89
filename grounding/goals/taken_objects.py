"""Let objects leave the structures that stood, where a later wish puts them elsewhere:
"the red cup goes on the plate".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import replace
from typing import Any

from grounding.goals.goal import Goal
from grounding.goals.part_numbers import renumbered
from grounding.goals.parts import Part, PartReference, StructurePart
from grounding.spec import SpecError

_STAYING = ("moved", "swapped")  # by a length, or for each other: these are done to what stands in a structure


def without_taken(goal: Goal, before: Goal) -> Goal:
    """Return a goal in which the structures of the goal so far are without the objects that new parts place.

    A structure of which nothing would be left stays as it was.

    Args:
        goal: after what was said.
        before: the goal so far.
    """
    new = [part for part in goal.parts if part not in before.parts]
    taken = {one for part in new for one in _placed(part)}
    parts = tuple(_left(part, taken) if part in before.parts else part for part in goal.parts)
    return goal if parts == goal.parts else Goal(parts)


def owned_once(parts: Sequence[Mapping[str, Any]], before: Goal) -> list[Mapping[str, Any]]:
    """Return parts in which what joins another structure has left the one that it was in.

    That is the structure which has most of its former companions. Where there were none, it stays in both, which no
    goal allows.

    Args:
        parts: as JSON values. before: the goal so far.
    """
    kept = [list(part["objects"]) if part["kind"] == "structure" and part["objects"] else [] for part in parts]
    listed = [set(each) for each in kept]
    for structure in before.structures:
        companions = set(structure.objects or ())
        for one in structure.objects or ():
            holders = [number for number, each in enumerate(listed) if one in each]
            shared = [len(companions & listed[number]) for number in holders]
            if len(holders) == 2 and shared[0] != shared[1]:
                kept[holders[shared.index(max(shared))]].remove(one)
    return [{**part, "objects": objects} if objects else part for part, objects in zip(parts, kept, strict=True)]


def without_placed(goal: Goal, taken: Set[object]) -> Goal:
    """Return a goal without what it does to some objects: their places in structures, and the parts that speak of them
    alone.

    A part that others refer to stays.
    """
    ends = (end for part in goal.relations for end in (part.objects, part.reference))
    referred = {end.part for end in ends if isinstance(end, PartReference)}
    kept = [
        number for number, part in enumerate(goal.parts)
        if number in referred or not isinstance(part.objects, tuple) or not set(part.objects) <= taken
    ]  # fmt: skip
    place = {old: new for new, old in enumerate(kept)}
    return Goal(tuple(renumbered(_left(goal.parts[old], taken), place) for old in kept))


def _placed(part: Part) -> tuple[object, ...]:
    staying = not isinstance(part, StructurePart) and part.relation in _STAYING
    return part.objects if isinstance(part.objects, tuple) and not staying else ()


def _left(part: Part, taken: Set[object]) -> Part:
    if not isinstance(part, StructurePart) or part.objects is None or taken.isdisjoint(part.objects):
        return part
    try:
        return replace(part, objects=tuple(one for one in part.objects if one not in taken))
    except SpecError:
        return part
