"""Between which figures the relations of a goal hold."""

from __future__ import annotations

from dataclasses import dataclass

from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError, Objects, PartReference, RelationPart, StructurePart
from structdiffusion.relations import RELATIONS
from structdiffusion.relations.relation import Relation
from structdiffusion.structures import structure_named


@dataclass(frozen=True)
class Bond:
    """One relation between one figure and its references.

    Attributes:
        number: of its part in the goal.
        part: the relation's part.
        members: the objects of the figure.
        references: the objects of each figure that it holds with.
    """

    number: int
    part: RelationPart
    members: tuple[int, ...]
    references: tuple[tuple[int, ...], ...]

    @property
    def relation(self) -> Relation:
        """Return the relation."""
        return RELATIONS[self.part.relation]

    @property
    def related(self) -> tuple[int, ...]:
        """Return every object that the figure is placed by."""
        return tuple(index for reference in self.references for index in reference)


def require_indices(goal: Goal, count: int) -> Goal:
    """Return the goal resolved in a scene of `count` objects.

    Raises:
        GoalError: if it has words in place of objects, an index that the scene does not have, or a structure of
            nothing.
    """
    for index in goal.named_objects():
        if not isinstance(index, int):
            raise GoalError(f"the goal names {index!r} in words; expected the indices of {count} objects")
        if index >= count:
            raise GoalError(f"the goal names object {index}; legal values: 0 to {count - 1}")
    return goal.resolved(count)


def bonds_of(goal: Goal) -> list[Bond]:
    """Return every relation of a resolved goal, figure by figure.

    Raises:
        GoalError: for figures between which a relation cannot hold; the message names the part.
    """
    bonds: list[Bond] = []
    for number, part in enumerate(goal.parts):
        if isinstance(part, RelationPart):
            bonds += _bonds_of_part(goal, number, part)
    return bonds


def _bonds_of_part(goal: Goal, number: int, part: RelationPart) -> list[Bond]:
    relation, where = RELATIONS[part.relation], f"part {number + 1}, {part.relation!r}"
    own = _members(goal, part.objects)
    if relation.mutual:
        one, other = own
        return [Bond(number, part, (one,), ((other,),)), Bond(number, part, (other,), ((one,),))]
    if isinstance(part.objects, PartReference):
        if relation.apart:
            raise GoalError(
                f"{where}: the {_shape(goal, part.objects)} as a whole cannot be {_said(part)}; name its objects"
            )
        figures = [own]
    else:
        figures = [(index,) for index in own]
    references = _references(goal, part, relation, where)
    for figure in figures:
        for reference in references:
            if set(figure) & set(reference):
                raise GoalError(f"{where}: an object cannot be placed by a structure that it belongs to")
    return [Bond(number, part, figure, references) for figure in figures]


def _references(goal: Goal, part: RelationPart, relation: Relation, where: str) -> tuple[tuple[int, ...], ...]:
    if part.reference is None:
        return ()
    members = _members(goal, part.reference)
    if relation.references > 1:
        if len(members) != relation.references:
            raise GoalError(f"{where}: it needs {relation.references} references, got {len(members)}")
        return tuple((index,) for index in members)
    if relation.carried and len(members) > 1:
        shape = _shape(goal, part.reference) if isinstance(part.reference, PartReference) else None
        if shape is None or not (structure_named(shape).stacks and relation.on_stacks):
            raise GoalError(f"{where}: one object has to carry the other, not {len(members)}")
    return (members,)


def _members(goal: Goal, objects: Objects) -> tuple[int, ...]:
    if isinstance(objects, PartReference):
        structure = goal.parts[objects.part]
        assert isinstance(structure, StructurePart)
        return tuple(structure.objects or ())  # type: ignore[arg-type]
    return tuple(objects)  # type: ignore[arg-type]


def _shape(goal: Goal, reference: PartReference) -> str | None:
    part = goal.parts[reference.part]
    return part.shape if isinstance(part, StructurePart) else None


def _said(part: RelationPart) -> str:
    return f"moved {part.direction}" if part.direction else f"put {part.relation} something"
