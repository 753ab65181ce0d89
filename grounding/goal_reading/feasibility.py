"""Find what objects cannot do by their kind: nothing stands on a ball."""

from __future__ import annotations

from collections.abc import Sequence

from grounding.goals.description import describe_part
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart

_BALLS = frozenset(
    "ball balls baseball softball football basketball golfball volleyball racquetball tennisball marble".split()
)


def infeasible(goal: Goal, names: Sequence[str]) -> str:
    """Say which part of a goal cannot stand, and why; "" where all can.

    Args:
        goal: the goal.
        names: of the scene's objects, by index.
    """
    balls = {i for i, name in enumerate(names) if _BALLS & set(name.lower().split())}
    for part in goal.parts:
        if isinstance(part, StructurePart):
            members = set(range(len(names)) if part.objects is None else part.objects)
            carrying = part.shape in ("tower", "pyramid") and len(members & balls) > 1
        else:
            under = part.reference if isinstance(part.reference, tuple) else ()
            carrying = part.relation == "on" and bool(set(under) & balls)
        if carrying:
            return f"{describe_part(part, names)!r} cannot stand: nothing stands on a ball"
    return ""
