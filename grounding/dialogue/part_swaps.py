"""Exchange the places of two parts, or of two objects, of a goal that is not built yet: "swap them"."""

from __future__ import annotations

import re
from dataclasses import replace

from grounding.dialogue.goal_changes import exchanged, listed, objects_of
from grounding.dialogue.goal_mentions import GoalText
from grounding.dialogue.part_lengths import CannotApplyError
from grounding.dialogue.relation_edits import FILLERS
from grounding.goals.goal import Goal
from grounding.goals.parts import DIRECTIONAL, Part, PartReference, RelationPart, StructurePart

SWAP = re.compile(
    r"\b(?:swap(?:ped)?|switch(?:ed)?|exchanged?|traded?|interchanged?|change(?= (?:places|parts|sides|roles)))"
    r"(?: (?:the|their|these|those|two|both|of|them|it))*"
    r"(?: (?:sides|places|positions|parts|roles|structures|around|round|over|between (?:them|em|each other)))*\b|\b(?:the )?other way (?:a)?round\b"
    r"|\bvice versa\b"
)
_FOR_ANOTHER = re.compile(r"\b(?:for|with|by|into)\b")


def swapped(text: GoalText) -> Goal | None:
    """Return the goal with two places exchanged; `None` where the sentence asks for no such exchange.

    Raises:
        CannotApplyError: where it does not say which two, or they have no places that could be exchanged.
    """
    found = SWAP.search(text.said)
    said = [one for one in text.mentions if one.indices]
    whole = _parts_of_objects(text.goal, [set(one.indices) for one in said])
    if found is None or (_FOR_ANOTHER.search(text.said) and not whole):
        return None
    spans = [found.span(), *(one.span for one in said), *(one.span for one in text.parts)]
    if left := text.left_over(spans, FILLERS):
        raise CannotApplyError(f"{' '.join(left)!r} was not understood")
    goal = text.goal
    if said and not whole:
        return _objects_exchanged(text, [one.indices for one in said])
    numbers = whole or text.targets() or tuple(range(len(goal.parts)))
    if len(numbers) == 1 and isinstance(part := goal.parts[numbers[0]], RelationPart):
        return _turned_over(goal, numbers[0], part)
    placed = [
        n for n in numbers if getattr(goal.parts[n], "x_position", None) or getattr(goal.parts[n], "y_position", None)
    ]
    if len(numbers) == 1 and getattr(goal.parts[numbers[0]], "order", None) is not None:
        return None  # the order is turned round
    if (turned := _sides_exchanged(goal, numbers)) is not None:
        return turned
    if len(numbers) == 2 and len(placed) == 2:
        one, other = numbers
        if _place(goal.parts[one]) == _place(goal.parts[other]):
            raise CannotApplyError(f"both are at the same place; the goal is: {listed(goal, text.names)}")
        return Goal(tuple(
            _with_place(part, goal.parts[other if n == one else one]) if n in (one, other) else part
            for n, part in enumerate(goal.parts)
        ))  # fmt: skip
    raise CannotApplyError(
        f"it is not clear which two places should be exchanged; the goal is: {listed(goal, text.names)}"
    )


def _parts_of_objects(goal: Goal, said: list[set[int]]) -> tuple[int, ...]:
    """Return the two structures of which all objects are named, as in "swap the bottles and the jars"; none otherwise."""
    own = {n: set(objects_of(goal, part.objects)) for n, part in enumerate(goal.parts) if isinstance(part, StructurePart)}
    numbers = tuple(n for each in said for n, objects in own.items() if len(objects) > 1 and objects == each)
    return numbers if len(numbers) == len(said) == 2 else ()


def _objects_exchanged(text: GoalText, said: list[tuple[int, ...]]) -> Goal | None:
    """Exchange two objects wherever the goal names them; `None` where it does not name both."""
    meant = [index for indices in said for index in indices]
    named = {index for part in text.goal.parts for index in objects_of(text.goal, part.objects)}
    if len(meant) != 2 or not set(meant) <= named:
        return None
    instead = {meant[0]: meant[1], meant[1]: meant[0]}
    parts = tuple(exchanged(part, instead) for part in text.goal.parts)
    same = all(set(objects_of(text.goal, new.objects)) == set(objects_of(text.goal, old.objects))
               for new, old in zip(parts, text.goal.parts, strict=True))  # fmt: skip
    if same and not any(getattr(getattr(part, "order", None), "by", "") == "listed" for part in parts):
        return None
    return Goal(parts)


def _turned_over(goal: Goal, number: int, part: RelationPart) -> Goal:
    """Exchange the object of a relation and its reference: "the bowl left of the plate" becomes the opposite."""
    legal = (*DIRECTIONAL, "next to", "on", "in")
    if part.relation not in legal or part.reference is None or isinstance(part.objects, PartReference):
        raise CannotApplyError(f"“{part.relation}” has no two places that could be exchanged")
    return Goal(
        (*goal.parts[:number], replace(part, objects=part.reference, reference=part.objects), *goal.parts[number + 1 :])
    )


def _sides_exchanged(goal: Goal, numbers: tuple[int, ...]) -> Goal | None:
    """Exchange the opposite sides of one reference on which two objects go; `None` where they are on no such sides."""
    if len(numbers) != 2:
        return None
    one, other = (goal.parts[number] for number in numbers)
    if not (isinstance(one, RelationPart) and isinstance(other, RelationPart)) or one.reference != other.reference:
        return None
    if one.relation not in DIRECTIONAL or other.relation not in DIRECTIONAL or one.relation == other.relation:
        return None
    instead = {numbers[0]: replace(one, relation=other.relation), numbers[1]: replace(other, relation=one.relation)}
    return Goal(tuple(instead.get(number, part) for number, part in enumerate(goal.parts)))


def _place(part: Part) -> tuple[object, object]:
    return getattr(part, "x_position", None), getattr(part, "y_position", None)


def _with_place(part: Part, other: Part) -> Part:
    return replace(part, x_position=getattr(other, "x_position", None), y_position=getattr(other, "y_position", None))
