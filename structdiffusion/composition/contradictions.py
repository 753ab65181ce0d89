"""Find parts of a goal that contradict each other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from grounding.goals.description import describe_part
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from structdiffusion.evaluation_protocol import MAX_RELATION_OFF_DEGREES
from structdiffusion.relations.bonds import Bond
from structdiffusion.relations.directional import Directional
from structdiffusion.structures import structure_named
from structdiffusion.structures.structure import LayoutError


def require_consistent(goal: Goal, bonds: Sequence[Bond], names: Sequence[str]) -> None:
    """Refuse a resolved goal whose parts contradict each other.

    Args:
        goal: the goal.
        bonds: its relations, figure by figure.
        names: of the scene's objects.

    Raises:
        LayoutError: that names both parts.
    """

    def refuse(one: int, other: int, reason: str) -> None:
        said = " and ".join(f"part {i + 1} ({describe_part(goal.parts[i], names)})" for i in sorted((one, other)))
        raise LayoutError(f"{said} contradict each other: {reason}")

    _require_no_circles(bonds, refuse)
    _require_one_place(bonds, names, refuse)
    for bond in bonds:
        for number, part in enumerate(goal.parts):
            if not isinstance(part, StructurePart) or part.shape is None or structure_named(part.shape).stacks:
                continue
            for one in set(bond.members) & set(part.around or ()):
                what = f"the {names[one]} in the middle of the {part.shape} stays where it is"
                refuse(bond.number, number, what)
            settings = structure_named(part.shape).nouns is not None  # a bowl may stand on the plate of a table setting
            if bond.relation.carried and not settings and set(bond.members) & set(part.objects or ()):
                refuse(bond.number, number, f"what stands in the {part.shape} stands on the table")


def _require_no_circles(bonds: Sequence[Bond], refuse) -> None:
    """Refuse relations that lead round in a circle: each before the next along an axis, or each carried by the next."""
    for axis in (0, 1, None):
        steps: dict[tuple[int, ...], list[tuple[tuple[int, ...], int]]] = {}
        for bond in bonds:
            if axis is None and bond.relation.carried:
                steps.setdefault(bond.members, []).append((bond.references[0], bond.number))
            elif axis is not None and isinstance(bond.relation, Directional) and bond.relation.direction[axis]:
                ends = (bond.members, bond.references[0])
                low, high = ends[::-1] if bond.relation.direction[axis] > 0 else ends
                steps.setdefault(low, []).append((high, bond.number))
        if circle := _circle(steps):
            one, other = circle[0], circle[-1]
            refuse(
                one,
                other,
                "each would have to be on the other" if axis is None else "the places depend on each other in a circle",
            )


def _circle(steps: dict[tuple[int, ...], list[tuple[tuple[int, ...], int]]]) -> list[int] | None:
    """Return the numbers of the parts along a circle of steps, or `None`."""

    def follow(at: tuple[int, ...], path: list[tuple[int, ...]], parts: list[int]) -> list[int] | None:
        for following, number in steps.get(at, ()):
            if following in path:
                return [*parts[path.index(following) :], number]
            if found := follow(following, [*path, following], [*parts, number]):
                return found
        return None

    for start in steps:
        if found := follow(start, [start], []):
            return found
    return None


def _require_one_place(bonds: Sequence[Bond], names: Sequence[str], refuse) -> None:
    """Refuse two relations of one figure that put it at different places."""
    for one, other in combinations(bonds, 2):
        if one.number == other.number or set(one.members) != set(other.members):
            continue
        name = ", ".join(names[i] for i in one.members)
        if one.relation.carried and other.relation.carried and one.references != other.references:
            refuse(one.number, other.number, f"the {name} can be carried by one of them only")
        if one.relation.carried and other.relation.carried and one.part.relation != other.part.relation:
            refuse(one.number, other.number, f"the {name} is either on it or in it")
        for key in ("x_position", "y_position"):
            values = getattr(one.part, key), getattr(other.part, key)
            if None not in values and values[0] != values[1]:
                refuse(one.number, other.number, f"the {name} cannot be {values[0]} and {values[1]}")
        if one.relation.exact and other.relation.exact:
            refuse(one.number, other.number, f"each gives the {name} a place of its own")
        if isinstance(one.relation, Directional) and isinstance(other.relation, Directional):
            between = math.degrees(math.acos(float(np.clip(one.relation.direction @ other.relation.direction, -1, 1))))
            if one.references == other.references and between >= 2 * MAX_RELATION_OFF_DEGREES:
                refuse(
                    one.number, other.number,
                    f"no place lies within {MAX_RELATION_OFF_DEGREES:g} degrees of both directions",
                )  # fmt: skip
