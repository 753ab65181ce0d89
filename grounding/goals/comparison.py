"""Compare goals: which parts and keys a reader dropped, invented or read wrongly (evaluation protocol, "Scores of
reading").
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any

from grounding.goals.goal import Goal
from grounding.goals.part_numbers import renumbered
from grounding.goals.parts import GoalError, Part, PartReference, RelationPart

SAME_LENGTH = 0.01  # share by which two lengths may differ and be the same (evaluation protocol, "Scores of reading")


@dataclass(frozen=True)
class GoalComparison:
    """How a goal that was read differs from the true one (evaluation protocol, "Scores of reading").

    Attributes:
        exact: whether they are the same.
        dropped: parts of the true goal that nothing corresponds to.
        false_parts: parts of the read goal that correspond to nothing.
        false_fills: keys that the read goal fills where the true one leaves them open, over the corresponding parts.
        wrong: other keys and objects that differ, over the corresponding parts.
    """

    exact: bool
    dropped: tuple[int, ...]
    false_parts: tuple[int, ...]
    false_fills: tuple[str, ...]
    wrong: tuple[str, ...]


def compare_goals(read: Goal, truth: Goal, count: int | None = None) -> GoalComparison:
    """Compare a goal with the true one: the parts in any order, the same values in every key, lengths within 1 %.

    Parts correspond where their kind is the same, those that agree in the most keys first. A relation of several
    objects is the same as one relation of each, and everything that no part names is the same as those objects one by
    one.

    Args:
        read: the goal that was read.
        truth: the true goal.
        count: of objects in the scene; `None` if no scene is known.
    """
    ours, theirs = one_by_one(read, count), one_by_one(truth, count)
    matching: dict[int, int] = {}
    for depth in (0, 1):  # references to parts are compared once the parts that they mean are matched
        known = dict(matching)
        pairs = sorted(
            ((len(_differences(ours[i], theirs[j], known if depth else None)), i, j)
             for i in range(len(ours)) for j in range(len(theirs)) if type(ours[i]) is type(theirs[j])),
        )  # fmt: skip
        matching = {}
        for _, i, j in pairs:
            if i not in matching and j not in matching.values():
                matching[i] = j
    fills: list[str] = []
    wrong: list[str] = []
    for i, j in sorted(matching.items()):
        for key in _differences(ours[i], theirs[j], matching):
            filled = getattr(theirs[j], key) is None and getattr(ours[i], key) is not None and key != "objects"
            (fills if filled else wrong).append(key)
    dropped = tuple(j for j in range(len(theirs)) if j not in matching.values())
    extra = tuple(i for i in range(len(ours)) if i not in matching)
    exact = not (dropped or extra or fills or wrong)
    return GoalComparison(exact, dropped, extra, tuple(fills), tuple(wrong))


@lru_cache(maxsize=256)
def one_by_one(goal: Goal, count: int | None = None) -> tuple[Part, ...]:
    """Return the parts in a canonical form, with relations of one object each and, in a scene of `count` objects, all
    objects by index.
    """
    with suppress(GoalError):  # nothing is left to take: it stays as it was written
        goal = goal.resolved(count) if count is not None else goal
    goal = goal.canonical()
    parts: list[Part] = []
    place: dict[int, int] = {}  # of each structure among the parts that are returned
    for number, part in enumerate(goal.parts):
        place[number] = len(parts)
        if isinstance(part, RelationPart) and part.relation != "swapped" and isinstance(part.objects, tuple):
            parts += [replace(part, objects=(one,)) for one in part.objects]
        else:
            parts.append(part)
    return tuple(renumbered(part, place) for part in parts)


def _differences(one: Part, other: Part, matching: Mapping[int, int] | None) -> list[str]:
    names: Iterable[str] = (field.name for field in fields(one))
    return [name for name in names if not _same(getattr(one, name), getattr(other, name), matching)]


def _same(one: Any, other: Any, matching: Mapping[int, int] | None) -> bool:
    if isinstance(one, PartReference) and isinstance(other, PartReference):
        return matching is None or matching.get(one.part) == other.part
    if isinstance(one, (int, float)) and isinstance(other, (int, float)):
        return math.isclose(one, other, rel_tol=SAME_LENGTH, abs_tol=1e-9)
    return one == other
