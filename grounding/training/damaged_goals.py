"""Damage goals in one place: what a reader may get wrong, as examples of goals that were not meant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.goals.parts import (
    DIRECTIONAL,
    EDGES,
    MOVE_DIRECTIONS,
    ORDER_DIRECTIONS,
    GoalError,
    Part,
    PartReference,
    RelationPart,
    StructurePart,
)
from grounding.spec import LEGAL_VALUES, SLOTS_OF_SHAPE, SpecError

_FACTORS = (0.1, 0.5, 2.0, 3.0)  # of a length that is read wrongly
_NEIGHBOURS = (*DIRECTIONAL, "next to", "on")


def damaged(goal: Goal, count: int, rng: np.random.Generator) -> Goal | None:
    """Return a goal that differs from this one in one place; `None` where the draw does not lead to one.

    Args:
        goal: its objects are indices.
        count: of objects in the scene.
        rng: draws the place and the damage.
    """
    number = int(rng.integers(len(goal.parts)))
    try:
        if len(goal.parts) > 1 and rng.random() < 0.25:
            found = _without(goal, number)
        else:
            part = goal.parts[number]
            others = [index for index in range(count) if index not in goal.named_objects()]
            way = _structure if isinstance(part, StructurePart) else _relation
            changed = way(part, others, count, rng)  # type: ignore[arg-type]
            found = None if changed is None else _with(goal, number, changed)
    except (GoalError, SpecError):
        return None
    return None if found is None or compare_goals(found, goal, count).exact else found


def _without(goal: Goal, number: int) -> Goal | None:
    """Drop a part; `None` where parts refer to parts."""
    refers = any(isinstance(each, PartReference) for part in goal.relations for each in (part.objects, part.reference))
    return None if refers else Goal(tuple(part for place, part in enumerate(goal.parts) if place != number))


def _with(goal: Goal, number: int, part: Part) -> Goal:
    return Goal(tuple(part if place == number else each for place, each in enumerate(goal.parts)))


def _structure(
    part: StructurePart, others: Sequence[int], count: int, rng: np.random.Generator
) -> StructurePart | None:
    kind = rng.random()
    filled = [slot for slot, _ in part.spec.tokens() if slot != "shape"] + list(part.keys)
    if kind < 0.35 and filled:
        key = str(rng.choice(filled))
        return replace(part, **{key: None if rng.random() < 0.45 else _other_value(part, key, rng)})
    if kind < 0.5:
        slot = str(rng.choice(SLOTS_OF_SHAPE[part.shape]))
        new: dict[str, Any] = {slot: str(rng.choice(LEGAL_VALUES[slot]))}
        return None if getattr(part, slot) else replace(part, **new)
    if kind < 0.65:
        return replace(part, shape=str(rng.choice(LEGAL_VALUES["shape"])))
    objects = _other_objects(part.objects, others, 2, rng)
    return None if objects is None else replace(part, objects=objects)


def _relation(part: RelationPart, others: Sequence[int], count: int, rng: np.random.Generator) -> RelationPart | None:
    kind = rng.random()
    if kind < 0.4:
        if part.relation == "moved":
            return replace(part, direction=str(rng.choice(MOVE_DIRECTIONS)))
        if part.relation == "at":
            slot = str(rng.choice(["x_position", "y_position"]))
            new: dict[str, Any] = {slot: str(rng.choice(LEGAL_VALUES[slot]))}
            return replace(part, **new)
        distance = part.distance if part.relation != "on" and rng.random() < 0.8 else None
        return replace(part, relation=str(rng.choice(_NEIGHBOURS)), distance=distance)
    if kind < 0.5 and part.distance is not None:
        return replace(part, distance=part.distance * float(rng.choice(_FACTORS)))
    if kind < 0.65 and isinstance(part.objects, tuple) and isinstance(part.reference, tuple):
        return replace(part, objects=part.reference, reference=part.objects)
    key = "reference" if rng.random() < 0.5 and isinstance(part.reference, tuple) else "objects"
    own = getattr(part, key)
    everyone = [index for index in range(count) if not isinstance(own, tuple) or index not in own]
    objects = _other_objects(own, everyone, 1, rng)
    changed: dict[str, Any] = {key: objects}
    return None if objects is None else replace(part, **changed)


def _other_value(part: StructurePart, key: str, rng: np.random.Generator) -> Any:
    """Return another value of a key."""
    value = getattr(part, key)
    if key == "order":
        return replace(value, direction=str(rng.choice(ORDER_DIRECTIONS))) if value.by != "listed" else None
    if key in ("gap", "radius", "length"):
        return value * float(rng.choice(_FACTORS))
    if key in ("rows", "columns"):
        return value + 1
    return (
        str(rng.choice(EDGES if key == "along" else LEGAL_VALUES[key])) if key not in ("around", "group_by") else None
    )


def _other_objects(objects: Any, others: Sequence[int], least: int, rng: np.random.Generator) -> tuple[int, ...] | None:
    """Return objects of which one is missing, added or exchanged."""
    if not isinstance(objects, tuple):
        return None
    found, kind = list(objects), rng.random()
    if kind < 0.4 and len(found) > least:
        found.pop(int(rng.integers(len(found))))
    elif others and kind < 0.7:
        found.append(int(rng.choice(others)))
    elif others:
        found[int(rng.integers(len(found)))] = int(rng.choice(others))
    else:
        return None
    return tuple(found)
