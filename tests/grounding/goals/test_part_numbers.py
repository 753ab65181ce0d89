from __future__ import annotations

from grounding.goals.goal import Goal
from grounding.goals.part_numbers import laid_around
from grounding.goals.parts import PartReference, RelationPart, StructurePart

RING = StructurePart("circle", objects=(0, 1, 2))


def test_what_is_in_a_ring_is_what_the_ring_is_laid_around():
    goal = Goal((RelationPart("at", (5,), x_position="left"), RING, RelationPart("in", (4,), PartReference(1)),
                 RelationPart("behind", (6,), PartReference(1))))  # fmt: skip
    assert str(laid_around(goal)) == "5 at left; circle of 0, 1, 2, around 4; 6 behind part 2"


def test_other_goals_stay():
    line = Goal((StructurePart("line", objects=(0, 1, 2)), RelationPart("in", (4,), PartReference(0))))
    several = Goal((RING, RelationPart("in", (4, 5), PartReference(0))))
    own = Goal((RING, RelationPart("in", (2,), PartReference(0))))
    assert [laid_around(each) for each in (line, several, own)] == [line, several, own]
