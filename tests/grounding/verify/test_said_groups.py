"""Objects of an arrangement that nobody knows are not objects of the noun."""

import pytest

from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.verify.said_groups import unknown_group

TOWER, LINE, CIRCLE = (Goal((StructurePart(shape, objects=(0, 1, 2)),)) for shape in ("tower", "line", "circle"))


@pytest.mark.parametrize(("text", "goal", "before", "found"), [
    ("build a tower out of the back row of blocks", TOWER, Goal(), "the back row of blocks"),
    ("That left column of blocks? Turn it into a circle.", CIRCLE, Goal(), "That left column of blocks"),
    ("make a circle out of the pile of the blocks", CIRCLE, Goal(), "the pile of the blocks"),
    ("make a circle out of the row of blocks", CIRCLE, LINE, ""),  # that of the goal so far
    ("put the row of blocks on the left", LINE, Goal(), ""),
    ("move the heap of blocks to the left", TOWER, Goal(), ""),
    ("a row of blocks, no, a tower", TOWER, Goal(), ""),
    ("a tower of the blocks in the row", TOWER, Goal(), ""),
])  # fmt: skip
def test_groups(text, goal, before, found):
    assert unknown_group(text, ("blocks",), (goal, before)) == found
