"""Let objects leave the structures that stood, where a later wish puts them elsewhere: "the red cup goes on the plate"."""

from __future__ import annotations

from dataclasses import replace

from grounding.goals.goal import Goal
from grounding.goals.parts import Part, StructurePart
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


def _placed(part: Part) -> tuple[object, ...]:
    staying = not isinstance(part, StructurePart) and part.relation in _STAYING
    return part.objects if isinstance(part.objects, tuple) and not staying else ()


def _left(part: Part, taken: set[object]) -> Part:
    if not isinstance(part, StructurePart) or part.objects is None or taken.isdisjoint(part.objects):
        return part
    try:
        return replace(part, objects=tuple(one for one in part.objects if one not in taken))
    except SpecError:
        return part
