"""The semantic checks of goals of several parts: whether the objects on the table match every part.

The module is pure geometry. It is used on true models after physics (the verdict), and on proposed scenes whose
footprints are estimated. `structdiffusion.structures` and `structdiffusion.relations` define the checks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grounding.goals.goal import Goal
from grounding.goals.parts import RelationPart, StructurePart
from structdiffusion.evaluation_protocol import MAX_UNNAMED_MOVE
from structdiffusion.protocol.goal_keys import Grouping, key_checks
from structdiffusion.protocol.semantic import check_structure
from structdiffusion.relations.bonds import Bond, bonds_of, require_indices
from structdiffusion.relations.figure import Standing
from structdiffusion.simulation.world import TABLE
from structdiffusion.structures import structure_named
from structdiffusion.structures.checks import Check, on_table_check, position_checks


def check_goal(
    standing: Standing, goal: Goal, count: int, colors: Sequence[str] | None = None, aside: Sequence[int] = ()
) -> list[Check]:
    """Check every part of a goal, and that what no part names has stayed.

    Args:
        standing: the bodies on the table; the goal's objects are the first `count`.
        goal: the goal.
        count: the number of objects that the goal's indices count.
        colors: the name of each object's colour, for goals that group by it.
        aside: objects that may have been set aside: they stand upright on the table.

    Raises:
        GoalError: for a goal that these objects cannot be checked for.
    """
    resolved = require_indices(goal, count)
    checks: list[Check] = []
    alone = len(resolved.parts) == 1
    for number, part in enumerate(resolved.parts):
        if isinstance(part, StructurePart):
            own = structure_part_checks(standing, part, Grouping(colors), plain=goal.plain_spec is not None)
            checks += own if alone else _named(f"{part.shape or 'structure'} (part {number + 1})", own)
    for bond in bonds_of(resolved):
        checks += _named(bond_name(standing, bond, resolved), bond_checks(standing, bond))
    return checks + stay_checks(standing, resolved, aside)


def structure_part_checks(
    standing: Standing, part: StructurePart, grouping: Grouping = Grouping(), plain: bool = False
) -> list[Check]:
    """Check one structure: its shape over its own bodies, its keys, and that nothing of it rests on something else.

    Args:
        standing: what stands on the table.
        part: the structure, with the indices of its objects.
        grouping: by which values it is grouped, if it is.
        plain: whether the structure is the whole goal. An open shape then is any shape that holds, as it always was;
            beside other parts it is a group of which only the place is asked for.
    """
    members = _indices(part)
    bodies, table = standing.among(members), standing.table
    if part.group_by is not None:
        checks = grouping.checks(bodies, members, part, table)
    elif part.shape is None and not plain and only_placed(part):
        centre = np.array([body.centroid for body in bodies]).mean(axis=0)
        checks = [on_table_check(bodies), *position_checks(bodies, centre, part.spec, table)]
    else:
        checks = check_structure(bodies, part.spec, table)
    supports = [set(standing.bodies[i].rests_on) for i in members]
    foreign = sum(bool(carriers - {TABLE, *members}) for carriers in supports)
    checks = [*checks, Check("objects that rest on a distractor", foreign == 0, foreign, "0")]
    if part.shape is not None and structure_named(part.shape).stacks:
        leaning = sum(TABLE in carriers for carriers in supports)
        checks.append(Check("objects that rest on the table and on another", leaning == 0, leaning, "0"))
    return checks + key_checks(standing, part, members)


def only_placed(part: StructurePart) -> bool:
    """Return whether a structure asks for nothing but a place on the table."""
    return bool(part.x_position or part.y_position) and not (part.shape or part.size or part.rotation or part.keys)


def bond_checks(standing: Standing, bond: Bond) -> list[Check]:
    """Check one relation between one figure and its references."""
    figure, *references = (standing.figure(members) for members in (bond.members, *bond.references))
    return bond.relation.check(figure, references, bond.part)


def bond_name(standing: Standing, bond: Bond, goal: Goal) -> str:
    """Return a relation in words, such as "banana next to mug"."""

    def name(members: tuple[int, ...]) -> str:
        for number, part in enumerate(goal.parts):
            if isinstance(part, StructurePart) and len(members) > 1 and part.objects == members:
                return f"{part.shape or 'structure'} (part {number + 1})"
        return standing.figure(members).name

    part: RelationPart = bond.part
    place = " ".join(filter(None, (part.y_position, part.x_position)))
    return " ".join(filter(None, (name(bond.members), part.relation, place, " and ".join(map(name, bond.references)))))


def stay_checks(standing: Standing, goal: Goal, aside: Sequence[int] = ()) -> list[Check]:
    """Check that objects that no part names, and objects that a structure is laid around, have moved by at most 1 cm.

    Objects that were set aside have to stand on the table; the physical protocol checks that they are upright.
    """
    named = set(goal.named_objects())
    stays = {i for i in range(len(standing.bodies)) if i not in named}
    if stray := [i for i in aside if i in named]:
        raise ValueError(f"object {stray[0]} is named by the goal, so it cannot be set aside")
    stays -= set(aside)
    checks = []
    if stays:
        farthest = max(_moved(standing, i) for i in sorted(stays))
        limit = f"<= {MAX_UNNAMED_MOVE:g}"
        checks.append(Check("move of what is not named (m)", farthest <= MAX_UNNAMED_MOVE, farthest, limit))
    for index in aside:
        carriers = len(standing.bodies[index].rests_on)
        name = f"{standing.bodies[index].name}, set aside: things that it rests on"
        checks.append(Check(name, carriers == 0, carriers, "0"))
    return checks


def _moved(standing: Standing, index: int) -> float:
    return float(np.linalg.norm(standing.bodies[index].centroid - standing.before[index]))


def _indices(part: StructurePart) -> tuple[int, ...]:
    return tuple(part.objects or ())  # type: ignore[arg-type]


def _named(name: str, checks: Sequence[Check]) -> list[Check]:
    return [replace(check, name=f"{name}: {check.name}") for check in checks]
