"""A build turns to another goal: around what stands, and with what stays as it was asked for."""

from dataclasses import replace

import numpy as np
import pytest

from agent.errors import NoValidGoal
from agent.pipeline.laying_out import GoalLayouts
from agent.pipeline.proposing import propose_goal
from agent.pipeline.table_goal import TableGoal
from agent.pipeline.turning import carried_over, kept_parts, laid_around
from grounding.goals.goal import Goal
from grounding.goals.parts import PartReference, RelationPart, StructurePart
from structdiffusion.planners.geometric import GeometricPlanner
from structdiffusion.planners.goal_planner import GoalPlanner
from tests.agent.pipeline.test_laying_out import LINE, START, remainder, seen  # noqa: F401


def test_what_is_left_of_a_build_begins_another_one(seen):  # noqa: F811
    """Can 0 stands, jar 1 and can 2 are wanted still, jar 3 is not; a new object takes part."""
    before = remainder(seen, {0})
    moved = [replace(cloud, points=cloud.points.copy()) for cloud in seen.objects]
    joins = replace(moved[3], name="new one")
    now = replace(seen, objects=(*moved[:3], joins), distractors=(moved[3],))
    left = carried_over(before, now)
    names = [cloud.name for cloud in seen.objects]
    assert [cloud.name for cloud in left.first.objects] == [*names[:3], "new one", names[3]]
    assert left.left == (0, 1, 2, 3) and left.standing == {0} and [one.name for one in left.others] == [names[3]]
    assert np.allclose(left.goal_from_initial[0], np.eye(4)) and np.allclose(left.goal_from_initial[3], np.eye(4))
    for index, old in ((1, 1), (2, 2), (4, 3)):
        assert np.allclose(left.goal_from_initial[index], before.goal_from_initial[old])
    assert np.allclose(left.now_from_initial, np.eye(4))


def test_another_goal_fulfils_no_part_by_what_stands(seen):  # noqa: F811
    """The same remainder: of the same goal a part that stands is left out, of another one it is laid out."""
    names = tuple(cloud.name for cloud in seen.objects)
    goal = Goal((StructurePart("line", objects=(0, 1)), StructurePart("line", objects=(2, 3))))
    wanted, asked = TableGoal(goal, names, START), []

    def propose(scene, goal):
        asked.append(len(goal.goal.parts))
        raise NoValidGoal("nothing")

    for another in (False, True):
        assert GoalLayouts(wanted, propose, another).lay_out(remainder(seen, {0, 1})) == [] or not another
    assert asked[-1] == 2 and 2 not in asked[:-1]


def over(*parts):
    return TableGoal(Goal(parts), ("can", "jar", "can 2", "jar 2"), START)


TOWER = StructurePart("tower", objects=(0, 1))


@pytest.mark.parametrize(
    "parts, kept",
    [
        ((TOWER, RelationPart("behind", (2,), PartReference(0))), {0}),
        ((TOWER, RelationPart("behind", (2,), PartReference(0)), RelationPart("left of", (3,), (2,))), {0}),
        ((replace(TOWER, x_position="left"), RelationPart("left of", (3,), (2,))), {1}),
        ((StructurePart("tower", objects=(0, 1, 2)), RelationPart("left of", (3,), (2,))), set()),
    ],
)
def test_parts_are_kept_unless_they_speak_of_what_goes_elsewhere(parts, kept):
    before = ("tower of can, jar", "jar 2 left of can 2")
    assert kept_parts(over(*parts), before, ("can", "jar", "can 2", "jar 2")) == kept
    assert kept_parts(over(*parts), before, ("can", "can 2", "jar 2")) == kept - {0}


def test_what_was_asked_for_before_keeps_its_place_though_it_does_not_stand_yet(seen):  # noqa: F811
    """Can 0 of a line of two stands; the other jar comes behind it now."""
    names = tuple(cloud.name for cloud in seen.objects)
    line, added = StructurePart("line", objects=(0, 1)), RelationPart("behind", (3,), (2,))
    wanted = TableGoal(Goal((line, added)), names, START)
    place = {name: k for k, name in enumerate(names)}
    here = replace(seen, objects=seen.objects, distractors=())
    left = carried_over(remainder(seen, {0}), here)
    planner = GoalPlanner(GeometricPlanner())

    def propose(scene, goal):
        return propose_goal(planner, "geometric", scene, goal, 0, count=8)

    found = laid_around(wanted, left, wanted.sentences[:1], propose)
    assert found and np.array_equal(found[0].goal_from_initial[place[names[0]]], np.eye(4))
    assert np.allclose(found[0].goal_from_initial[1], (LINE @ np.linalg.inv(START))[1])
    assert not np.allclose(found[0].goal_from_initial[3], np.eye(4))
