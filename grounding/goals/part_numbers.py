"""Number the parts of a goal anew after some were left out, and say that a structure is laid around an object."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from grounding.goals.goal import Goal
from grounding.goals.parts import SHAPES_OF_KEY, Objects, Part, PartReference, RelationPart, StructurePart


def renumbered(part: Part, place: Mapping[int, int]) -> Part:
    """Return a part whose references to other parts have new numbers; `place` maps each old one to the new one."""

    def mapped(objects: Objects | None) -> Objects | None:
        return PartReference(place[objects.part]) if isinstance(objects, PartReference) else objects

    if isinstance(part, StructurePart):
        return part
    return replace(part, objects=mapped(part.objects), reference=mapped(part.reference))


def laid_around(goal: Goal) -> Goal:
    """Return a goal in which what is in a ring is what the ring is laid around: "a circle, with the bowl in it".

    An object cannot rest in several others, so that "in" of a structure as a whole means its middle.
    """
    parts = list(goal.parts)
    kept = []
    for number, part in enumerate(goal.parts):
        ring = _ring(goal, part)
        if ring is None:
            kept.append(number)
        else:
            parts[ring] = replace(parts[ring], around=part.objects)
    if len(kept) == len(parts):
        return goal
    place = {old: new for new, old in enumerate(kept)}
    return Goal(tuple(renumbered(parts[old], place) for old in kept))


def _ring(goal: Goal, part: Part) -> int | None:
    """Return the number of the structure in whose middle a part puts one object; `None` for other parts."""
    if not isinstance(part, RelationPart) or part.relation != "in" or not isinstance(part.reference, PartReference):
        return None
    structure = goal.parts[part.reference.part]
    if not isinstance(structure, StructurePart) or structure.shape not in SHAPES_OF_KEY["around"]:
        return None
    one = isinstance(part.objects, tuple) and len(part.objects) == 1 and part.distance is None
    free = structure.around is None and not set(structure.objects or ()) & set(part.objects if one else ())
    return part.reference.part if one and free else None
