"""Find what objects cannot do, and say what could be had instead: nothing stands on a ball,
a shape needs a number of objects.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from grounding.figures.drawings import without_drawings
from grounding.figures.words import WORD
from grounding.goals.description import describe_part
from grounding.goals.goal import Goal
from grounding.goals.parts import PartReference, RelationPart, StructurePart
from grounding.structure_words import words_of
from grounding.verify.wording import with_article, worded_goal, worded_objects

_BALLS = frozenset(
    "ball balls baseball softball football basketball golfball volleyball racquetball tennisball marble".split()
)


def infeasible(goal: Goal, names: Sequence[str]) -> str:
    """Say which part of a goal cannot be, why, and what to say instead; "" where all can.

    Args:
        goal: the goal.
        names: of the scene's objects, by index.
    """
    elsewhere = {one for one in goal.named_objects() if isinstance(one, int)}
    for part in goal.parts:
        if isinstance(part, StructurePart):
            free = tuple(one for one in range(len(names)) if one not in elsewhere)
            members = free if part.objects is None else part.objects
            found = _structure(part, members, names) or _pieces(part, goal, names)
        else:
            found = _relation(part, names)
        if found:
            return found
    return ""


def _structure(part: StructurePart, members: Sequence[int | str], names: Sequence[str]) -> str:
    """Say why a structure cannot be made of these objects, or ""."""
    if part.shape is None:
        return ""
    words = words_of(part.shape)
    what = with_article(without_drawings(words.name))
    those = worded_objects(members, names)
    if not members:
        return f"{what} needs {words.least} objects, but no object is left for it"
    if len(members) < words.least:
        count = f"{those} {'are' if len(members) > 1 else 'is'} only {len(members)}"
        instead = (
            _fewer(part, members)
            if len(members) > 1
            else Goal((RelationPart("at", tuple(members), x_position="left"),))
        )
        needed = words.least if words.figure is None else words.figure.legal_numbers()
        return f"{what} needs {needed} objects, but {count}; say {worded_goal(instead, names)!r}"
    if words.figure is not None and len(members) not in words.figure.legal:
        most = max(number for number in words.figure.legal if number < len(members))
        some = Goal((replace(part, objects=tuple(members[:most])),))
        return (
            f"{what} needs {words.figure.legal_numbers()} objects, but {those} are {len(members)}; say "
            f"{worded_goal(some, names)!r}"
        )
    if words.stacked and len(members) > 1 and sum(_is_ball(one, names) for one in members) > 1:
        return (
            f"nothing can stand on a ball, so {what} of {those} cannot be built; say "
            f"{worded_goal(_line(part, members), names)!r}"
        )
    if part.rows and part.columns and not _filled(part.rows, part.columns, len(members)):
        rows, columns = _nearest_grid(part.rows, part.columns, len(members))
        fitting = worded_goal(Goal((replace(part, rows=rows, columns=columns),)), names)
        needed = f"{(part.rows - 1) * part.columns + 1} to {part.rows * part.columns}"
        return (
            f"{what} of {part.rows} rows and {part.columns} columns needs {needed} objects, but {those} are "
            f"{len(members)}; say {fitting!r}"
        )
    return ""


def _fewer(part: StructurePart, members: Sequence[int | str]) -> Goal:
    """Return what some objects make in place of a structure that needs more: the beginning of a word, or a line."""
    shape = part.shape or ""
    for end in range(len(shape) - 1, len(WORD) + 1, -1) if shape.startswith(WORD) else ():
        if len(members) in words_of(shape[:end]).figure.legal:  # type: ignore[union-attr]
            return Goal((replace(part, shape=shape[:end], objects=tuple(members)),))
    return _line(part, members)


def _line(part: StructurePart, members: Sequence[int | str]) -> Goal:
    """Return a line of some objects where the structure was to be."""
    return Goal((StructurePart("line", None, part.x_position, part.y_position, objects=tuple(members)),))


def _filled(rows: int, columns: int, count: int) -> bool:
    return (rows - 1) * columns < count <= rows * columns


def _nearest_grid(rows: int, columns: int, count: int) -> tuple[int, int]:
    """Return the rows and columns nearest to those asked for that some objects fill."""
    fitting = [
        (each, math.ceil(count / each)) for each in range(1, count + 1) if _filled(each, math.ceil(count / each), count)
    ]
    return min(fitting, key=lambda one: abs(one[0] - rows) + abs(one[1] - columns))


def _is_ball(one: int | str, names: Sequence[str]) -> bool:
    return isinstance(one, int) and bool(_BALLS & set(names[one].lower().split()))


def _relation(part: RelationPart, names: Sequence[str]) -> str:
    """Say why some objects cannot be where they are to be, or ""."""
    if part.relation == "in" and isinstance(part.reference, PartReference):
        return (
            f"{describe_part(part, names)!r} is not possible: an object can only be in another object, or in the "
            "middle of a ring"
        )
    if (
        part.relation == "on"
        and isinstance(part.reference, tuple)
        and any(_is_ball(one, names) for one in part.reference)
    ):
        instead = (
            worded_goal(Goal((replace(part, relation="next to"),)), names) if isinstance(part.objects, tuple) else ""
        )
        under = worded_objects(part.reference, names)
        return f"nothing can stand on {under}, because a ball rolls" + (f"; say {instead!r}" if instead else "")
    return ""


def _pieces(part: StructurePart, goal: Goal, names: Sequence[str]) -> str:
    """Say which piece of a structure with places of its own is placed for itself:
    "set the table but put the fork on the right".
    """
    pieces = frozenset(words_of(part.shape).pieces) if part.shape else frozenset()
    for other in goal.parts:
        if isinstance(other, RelationPart) and other.relation == "at" and isinstance(other.objects, tuple):
            for one in other.objects:
                its_own = part.objects is None or one in part.objects
                if isinstance(one, int) and its_own and pieces & set(names[one].lower().split()):
                    return (
                        f"the place of the {names[one]} in a {part.shape} cannot be chosen; leave it out, or place "
                        "all of it"
                    )
    return ""
