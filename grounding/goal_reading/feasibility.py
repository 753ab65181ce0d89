"""Find what objects cannot do: nothing stands on a ball, and a shape needs a number of objects."""

from __future__ import annotations

from collections.abc import Sequence

from grounding.goals.description import describe_part
from grounding.goals.goal import Goal
from grounding.goals.parts import PartReference, RelationPart, StructurePart

# How many objects a shape needs (evaluation protocol).
LEAST_OBJECTS = {
    "circle": 3, "line": 2, "tower": 2, "cluster": 2, "rectangle": 4, "square": 4, "triangle": 3, "arc": 3, "grid": 4,
    "cross": 5, "pyramid": 3,
}  # fmt: skip

_PIECES = frozenset("plate saucer bowl fork knife spoon cup mug glass".split())
_BALLS = frozenset(
    "ball balls baseball softball football basketball golfball volleyball racquetball tennisball marble".split()
)


def infeasible(goal: Goal, names: Sequence[str]) -> str:
    """Say which part of a goal cannot stand, and why; "" where all can.

    Args:
        goal: the goal.
        names: of the scene's objects, by index.
    """
    if taken := _taken_out_of_a_setting(goal, names):
        return taken
    balls = {i for i, name in enumerate(names) if _BALLS & set(name.lower().split())}
    for part in goal.parts:
        if isinstance(part, StructurePart):
            members = set(range(len(names)) if part.objects is None else part.objects)
            carrying = part.shape in ("tower", "pyramid") and len(members & balls) > 1
        else:
            under = part.reference if isinstance(part.reference, tuple) else ()
            carrying = part.relation == "on" and bool(set(under) & balls)
            if part.relation == "in" and isinstance(part.reference, PartReference):
                return f"{describe_part(part, names)!r} cannot be: an object can be in another one, or in the middle of a ring"
        if carrying:
            return f"{describe_part(part, names)!r} cannot stand: nothing stands on a ball"
    return ""


def _taken_out_of_a_setting(goal: Goal, names: Sequence[str]) -> str:
    """Say which piece of a table setting is placed for itself: "set the table but put the fork on the right"."""
    if not any(part.shape == "table setting" for part in goal.structures):
        return ""
    for part in goal.parts:
        if isinstance(part, RelationPart) and part.relation == "at" and isinstance(part.objects, tuple):
            pieces = [names[i] for i in part.objects if isinstance(i, int) and _PIECES & set(names[i].lower().split())]
            if pieces:
                return f"the place of the {pieces[0]} in a table setting cannot be chosen; leave it out, or place all of it"
    return ""


def too_few(goal: Goal, count: int) -> bool:
    """Return whether a shape of a goal has fewer objects than it needs, or a grid none that fill its rows and columns.

    Args:
        goal: the goal.
        count: of objects in the scene.
    """
    elsewhere = {one for one in goal.named_objects() if isinstance(one, int)}
    for part in goal.structures:
        members = count - len(elsewhere) if part.objects is None else len(part.objects)
        if members < LEAST_OBJECTS.get(part.shape or "", 1):
            return True
        rows, columns = part.rows, part.columns
        if rows and columns and not (rows - 1) * columns < members <= rows * columns:
            return True
    return False
