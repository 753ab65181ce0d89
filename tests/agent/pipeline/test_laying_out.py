"""A goal is laid out anew where something is gone or in the way, and what stands need not be moved for it."""

import numpy as np
import pytest

from agent import events
from agent.arm.events import Noticed, Picked, Placed, Planned
from agent.arm.remainder import Remainder
from agent.errors import PartlyDone
from agent.pipeline.building import build_with_arm
from agent.pipeline.laying_out import GoalLayouts, StructureLayouts
from agent.pipeline.proposing import propose_arrangements, propose_goal
from agent.pipeline.resources import ResourceCache
from agent.pipeline.table_goal import TableGoal
from agent.reporting.event_schema import payload_error
from agent.reporting.event_text import arm_sentence, verdict_sentence
from agent.scenes.table_scene import TableScene
from grounding.goals.goal import Goal
from grounding.goals.parts import RelationPart, StructurePart
from grounding.spec import StructureSpec
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement, ObjectCloud, StructureGoal
from structdiffusion.planners.geometric import GeometricPlanner
from structdiffusion.planners.goal_planner import GoalPlanner
from structdiffusion.simulation.world import TabletopWorld

KINDS = ("can", "jar", "can", "jar")
START = np.array([pose_from_xyz_yaw(0.3, y, 0.0, 0.0) for y in (-0.3, -0.1, 0.1, 0.3)])
LINE = np.array([pose_from_xyz_yaw(0.55, y, 0.0, 0.0) for y in (-0.21, -0.07, 0.07, 0.21)])
AWAY = pose_from_xyz_yaw(0.0, 0.0, -20.0, 0.0)


def models():
    return [procedural_object(kind, index) for index, kind in enumerate(KINDS)]


@pytest.fixture(scope="module")
def seen():
    with TabletopWorld(models(), list(START)) as world:
        world.settle()
        return world.observe(np.random.default_rng(0))


def proposing(asked):
    """Propose arrangements by the geometric planner, and keep the scenes that it was asked about."""

    def propose(scene):
        asked.append(scene)
        goal = StructureGoal(StructureSpec("line"))
        return propose_arrangements(GeometricPlanner(), "geometric", scene, goal, 0, count=16).arrangements

    return propose


def remainder(seen, standing, gone=(), others=()):
    motions = LINE @ np.linalg.inv(START)
    now = np.array([motion if index in standing else np.eye(4) for index, motion in enumerate(motions)])
    left = tuple(index for index in range(4) if index not in gone)
    return Remainder(seen, tuple(others), left, now, motions, frozenset(standing) - set(gone))


def places(arrangement, left):
    return np.array([(arrangement.goal_from_initial[index] @ START[index])[:2, 3] for index in left])


def test_what_waits_takes_the_place_of_what_is_gone(seen):
    """Two at one end stand, the third is gone: the fourth goes beside them, and nothing else moves."""
    asked = []
    rest = remainder(seen, {0, 1}, gone={2})
    best = StructureLayouts(StructureSpec("line"), proposing(asked)).lay_out(rest)[0]
    np.testing.assert_array_equal(best.goal_from_initial[[0, 1]], rest.now_from_initial[[0, 1]])
    np.testing.assert_array_equal(best.goal_from_initial[2], np.eye(4))
    np.testing.assert_allclose(places(best, [3]), [LINE[2, :2, 3]], atol=0.01)
    assert [cloud.name for cloud in asked[0].objects] == [seen.objects[index].name for index in (0, 1, 3)]


def test_no_place_is_taken_where_something_stands(seen):
    """Something stands where the third was to go: two moved objects at most, and all clear of it."""
    x, y = LINE[2, :2, 3]
    points = np.random.default_rng(0).uniform(-0.03, 0.03, (200, 3)) + (x, y, 0.03)
    cloud = ObjectCloud("something 1", "object", points)
    found = StructureLayouts(StructureSpec("line"), proposing([])).lay_out(remainder(seen, {0}, others=[cloud]))
    assert found and len(found) <= 8
    for arrangement in found:
        assert np.linalg.norm(places(arrangement, range(4)) - (x, y), axis=1).min() > 0.04


def goal_of(*parts):
    return TableGoal(Goal(parts), ("a", "b", "c", "d"), START, ("red",) * 4)


LEFT_OF = RelationPart("left of", objects=(3,), reference=(0,))


@pytest.mark.parametrize(
    "parts, gone, left",
    [
        ((StructurePart("line", objects=(0, 1, 2, 3)),), "b", [(0, 1, 2)]),
        ((StructurePart("circle", objects=(0, 1, 2)), LEFT_OF), "b", None),  # two make no circle
        ((StructurePart("line", objects=(0, 1, 2)), LEFT_OF), "d", [(0, 1, 2)]),
        ((StructurePart("line", objects=(1, 2)), LEFT_OF), "a", None),  # left of what?
        ((StructurePart("line", objects=(1, 2)), LEFT_OF), "", [(1, 2), (3,)]),
        ((LEFT_OF,), "d", None),
    ],
)
def test_a_goal_without_what_is_gone(parts, gone, left):
    rest = goal_of(*parts).without(set(gone))
    assert (None if rest is None else [part.objects for part in rest.goal.parts]) == left
    if rest is not None:
        kept = [name for name in "abcd" if name not in gone]
        assert rest.names == tuple(kept) and len(rest.world_from_initial) == len(rest.colors) == len(kept)


def test_parts_that_hold_stay_as_they_are(seen):
    """The line stands; only what was to go left of one of it is placed elsewhere, as its place is taken."""
    names = tuple(cloud.name for cloud in seen.objects)
    wanted = TableGoal(Goal((StructurePart("line", objects=(0, 1, 2)), LEFT_OF)), names, START)
    planner = GoalPlanner(GeometricPlanner())
    layouts = GoalLayouts(wanted, lambda scene, goal: propose_goal(planner, "geometric", scene, goal, 0))
    found = layouts.lay_out(remainder(seen, {0, 1, 2}))
    rest = remainder(seen, {0, 1, 2})
    assert found
    for arrangement in found:
        np.testing.assert_allclose(arrangement.goal_from_initial[:3], rest.now_from_initial[:3])
        x, y = places(arrangement, [3])[0] - LINE[0, :2, 3]
        assert y > abs(x)
    assert layouts.concerns(names[0]) and not layouts.concerns("something 1")


def test_the_sentence_model_lays_out_the_one_structure_that_is_left(seen):
    """What was placed by a relation stands already: the sentence of the line alone is the model's condition."""
    names = tuple(cloud.name for cloud in seen.objects)
    beside = RelationPart("left of", objects=(3,), reference=(0,))
    wanted = TableGoal(Goal((StructurePart("line", objects=(1, 2)), beside)), names, START)
    planner = ResourceCache().goal_planner("diffusion", None)
    layouts = GoalLayouts(wanted, lambda scene, goal: propose_goal(planner, "diffusion", scene, goal, 0, count=8))
    rest = remainder(seen, {0, 3})
    found = layouts.lay_out(rest)
    assert found
    for arrangement in found:
        np.testing.assert_allclose(arrangement.goal_from_initial[[0, 3]], rest.now_from_initial[[0, 3]])


@pytest.fixture(scope="module")
def with_one_gone():
    """The events of a line of four of which one is taken away while the second is in the hand."""
    happened = []
    with TableScene(models(), START, 4, np.random.default_rng(0)) as table:
        table.arm.hold_by("weld")
        scene = table.look()
        replanner = StructureLayouts(StructureSpec("line"), proposing([]))
        chosen = [Arrangement(LINE @ np.linalg.inv(START))]
        work = build_with_arm(table, scene, StructureSpec("line"), chosen, 0, film=False, replanner=replanner)
        try:
            for event in work:
                happened.append(event)
                placed = [one.object for one in happened if isinstance(one, Placed)]
                if isinstance(event, Picked) and len(placed) == 1:
                    waiting = next(index for index in range(4) if index not in (*placed, event.object))
                    table.world.set_pose(waiting, AWAY)
                    table.world.hold(waiting)
        except PartlyDone as error:
            return happened, str(error), table.names
    raise AssertionError("it was not told that an object is gone")


def test_k_of_n_stand_when_one_is_gone(with_one_gone):
    happened, error, names = with_one_gone
    (noticed,) = [event for event in happened if isinstance(event, Noticed)]
    assert (noticed.what, noticed.action) == ("gone", "lay out anew")
    assert error == f"3 of 4 objects stand as asked: {noticed.name} is gone"
    verdict = next(event for event in happened if isinstance(event, events.Checked))
    assert verdict.success and verdict.count == 3 and verdict.left_out == (noticed.name,)
    assert verdict_sentence(verdict.to_dict()) == f"3 of 4 objects stand as asked ({noticed.name} is left out)."
    assert noticed.object not in [event.object for event in happened if isinstance(event, Placed)]


def test_the_new_arrangement_is_told_and_numbered_after_the_others(with_one_gone):
    happened, _, names = with_one_gone
    first, second = [event for event in happened if isinstance(event, Planned)]
    assert first.arrangement == 0 and second.arrangement >= 1
    chosen = next(event for event in happened if isinstance(event, events.Chosen))
    assert chosen.rank == second.arrangement + 1
    for event in happened:
        assert payload_error(event.to_dict()) is None
    (noticed,) = [event for event in happened if isinstance(event, Noticed)]
    said = arm_sentence(noticed.to_dict(), names)
    assert said == f"noticed: {noticed.name} is gone; what is left is laid out anew"
