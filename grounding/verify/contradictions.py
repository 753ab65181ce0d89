"""Find parts of a goal that cannot hold together."""

from __future__ import annotations

from collections.abc import Sequence

from grounding.goals.description import describe_part
from grounding.goals.goal import Goal
from grounding.goals.parts import DIRECTIONAL, PartReference, RelationPart, StructurePart
from grounding.spec import OPPOSITE


def contradiction(goal: Goal, names: Sequence[str] | None = None) -> str:
    """Name two parts of a goal that exclude each other; "" where there are none.

    Args:
        goal: the goal.
        names: of the scene's objects, by index.
    """
    facts: dict[tuple[object, str, object], int] = {}
    places: dict[object, int] = {}
    for number, part in enumerate(goal.parts):
        if isinstance(part, StructurePart):
            continue
        for one in _each(part.objects):
            for other in _each(part.reference):
                if (clash := _clash(facts, one, part.relation, other)) is not None:
                    return _both(goal, clash, number, names)
                facts[one, part.relation, other] = number
            if part.relation in ("at", "moved", "swapped"):
                if one in places and not _same_place(goal, places[one], number):
                    return _both(goal, places[one], number, names)
                places[one] = number
    return _in_own_structure(goal, names)


def _each(objects: object) -> tuple[object, ...]:
    if objects is None:
        return ()
    return (("part", objects.part),) if isinstance(objects, PartReference) else tuple(objects)  # type: ignore[arg-type]


def _clash(facts: dict, one: object, relation: str, other: object) -> int | None:
    if relation in DIRECTIONAL:
        for clash in ((other, relation, one), (one, OPPOSITE[relation], other)):
            if clash in facts:
                return facts[clash]
    if relation in ("on", "in"):
        for (mine, held, place), number in facts.items():  # nothing stands on two things
            if mine == one and held in ("on", "in") and place != other:
                return number
        for clash in ((other, "on", one), (other, "in", one)):
            if clash in facts:
                return facts[clash]
    return None


def _same_place(goal: Goal, one: int, other: int) -> bool:
    first, second = goal.parts[one], goal.parts[other]
    assert isinstance(first, RelationPart) and isinstance(second, RelationPart)
    if first.relation != "at" or second.relation != "at":
        return False
    return all(
        a is None or b is None or a == b
        for a, b in ((first.x_position, second.x_position), (first.y_position, second.y_position))
    )


def _both(goal: Goal, one: int, other: int, names: Sequence[str] | None) -> str:
    return f"{describe_part(goal.parts[one], names)!r} and {describe_part(goal.parts[other], names)!r}"


def _in_own_structure(goal: Goal, names: Sequence[str] | None) -> str:
    """Name an object that a structure is laid around, or stands by, and that is one of its own."""
    for number, part in enumerate(goal.parts):
        if not isinstance(part, RelationPart):
            continue
        for mine, others in ((part.objects, part.reference), (part.reference, part.objects)):
            if isinstance(mine, PartReference) and isinstance(others, tuple):
                structure = goal.parts[mine.part]
                if isinstance(structure, StructurePart) and structure.objects and set(structure.objects) & set(others):
                    return _both(goal, mine.part, number, names)
    return ""
