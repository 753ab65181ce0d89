"""Number the parts of a goal anew after some were left out, and say that a structure is laid around an object."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

from grounding.goals.goal import Goal
from grounding.goals.parts import Objects, Part, PartReference, RelationPart, StructurePart, takes_key


def renumbered(part: Part, place: Mapping[int, int]) -> Part:
    """Return a part whose references to other parts have new numbers; `place` maps each old one to the new one."""

    def mapped(objects: Any) -> Any:
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
            continue
        structure = parts[ring]
        assert isinstance(structure, StructurePart) and isinstance(part.objects, tuple)
        parts[ring] = replace(structure, around=part.objects)
    if len(kept) == len(parts):
        return goal
    place = {old: new for new, old in enumerate(kept)}
    return Goal(tuple(renumbered(parts[old], place) for old in kept))


def _ring(goal: Goal, part: Part) -> int | None:
    """Return the number of the structure in whose middle a part puts one object; `None` for other parts."""
    if not isinstance(part, RelationPart) or part.relation != "in" or not isinstance(part.reference, PartReference):
        return None
    structure = goal.parts[part.reference.part]
    if not isinstance(structure, StructurePart) or not takes_key(structure.shape, "around"):
        return None
    if not isinstance(part.objects, tuple) or len(part.objects) != 1 or part.distance is not None:
        return None
    free = structure.around is None and not set(structure.objects or ()) & set(part.objects)
    return part.reference.part if free else None


def still_to_build(goal: Goal, standing: Collection[int]) -> Goal:
    """Return the parts of a goal that do not stand yet, with what they need to know of the others.

    Where they speak of a standing structure as a whole, its objects take its place.

    Args:
        goal: every structure lists its objects.
        standing: the numbers of the parts that stand.
    """
    kept = {number for number in range(len(goal.parts)) if number not in standing}
    kept |= {
        other for number in kept for other, part in enumerate(goal.parts) if PartReference(number) in _speaks_of(part)
    }
    for number in sorted(kept):
        part = goal.parts[number]
        if isinstance(part, RelationPart) and part.relation == "on" and isinstance(part.reference, PartReference):
            kept.add(part.reference.part)  # what is put on a tower needs to know the tower
    place = {old: new for new, old in enumerate(sorted(kept))}

    def written_out(objects: Any) -> Any:
        outside = isinstance(objects, PartReference) and objects.part not in place
        return goal.parts[objects.part].objects if outside else objects

    parts = [
        replace(part, objects=written_out(part.objects), reference=written_out(part.reference))
        if isinstance(part, RelationPart) else part
        for part in (goal.parts[old] for old in place)
    ]  # fmt: skip
    return Goal(tuple(renumbered(part, place) for part in parts))


def _speaks_of(part: Part) -> tuple[Objects | None, ...]:
    return (part.objects, part.reference) if isinstance(part, RelationPart) else ()
