"""Relations to structures that are figures."""

import pytest

from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError, PartReference, RelationPart, StructurePart
from structdiffusion.relations.bonds import bonds_of


def goal(shape, relation, count=4):
    return Goal((StructurePart(shape, objects=tuple(range(count))), RelationPart(relation, (count,), PartReference(0))))


@pytest.mark.parametrize("shape", ["letter T", "gate", "word HI", "circle"])
def test_beside_a_figure_as_beside_a_shape(shape):
    (bond,) = bonds_of(goal(shape, "left of", 12))
    assert bond.members == (12,) and bond.references == (tuple(range(12)),)


@pytest.mark.parametrize("shape", ["gate", "brick wall", "tower", "pyramid"])
def test_what_stands_can_carry_something_as_a_whole(shape):
    (bond,) = bonds_of(goal(shape, "on", 3))
    assert bond.references == ((0, 1, 2),)


@pytest.mark.parametrize("shape", ["letter T", "heart", "circle"])
def test_what_lies_on_the_table_cannot(shape):
    with pytest.raises(GoalError, match="one object has to carry the other, not 4"):
        bonds_of(goal(shape, "on"))
