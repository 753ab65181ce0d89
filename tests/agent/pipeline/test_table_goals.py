"""Goals of several parts on a table: which objects they move, the proposals, one build, and the verdict."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest

from agent import events
from agent.arm.arm_model import DEFAULT_MODEL, arm_model
from agent.arm.events import Placed, Planned
from agent.arm.fixed_objects import with_fixed
from agent.errors import ExecutionFailed, NotBuildable, NoValidGoal
from agent.event_base import Event
from agent.pipeline.building import build_with_arm
from agent.pipeline.event_builders import chosen_event, describe_aside
from agent.pipeline.proposing import propose_goal
from agent.pipeline.release import release_in_physics
from agent.pipeline.resources import ResourceCache
from agent.pipeline.table_goal import put_on_table, renumbered
from agent.scenes.table_scene import TableScene
from grounding.goals.goal import Goal
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.structures.structure import LayoutError

PLACES = ((0.40, 0.20), (0.45, -0.20), (0.60, 0.05), (0.32, 0.0))


@dataclass(frozen=True)
class Found:
    moved: tuple[int, ...]
    goal_from_initial: np.ndarray
    scores: dict[str, float]
    aside: tuple[int, ...] = ()
    order: tuple[int, ...] = ()


class Given:
    """Proposes that objects are moved by given steps (x, y), one dictionary for each arrangement."""

    def __init__(self, *steps: dict[int, tuple[float, float]]) -> None:
        self.steps = steps

    def propose(self, scene, goal, *, count, generator, colors) -> list[Found]:
        self.scene = scene
        found = []
        for steps in self.steps:
            motions = np.tile(np.eye(4), (len(scene.objects), 1, 1))
            for index, step in steps.items():
                motions[index, :2, 3] = step
            found.append(Found(tuple(sorted(steps)), motions, {"total": 0.9}))
        return found


class Helpless:
    def propose(self, scene, goal, *, count, generator, colors):
        raise LayoutError("part 2 (bowl left of mug): there is no room left of mug")


def goal_of(*parts: dict) -> Goal:
    return Goal.from_dict({"parts": list(parts)})


def moved(index: int, direction: str, distance: float) -> dict:
    return {"kind": "relation", "relation": "moved", "objects": [index], "direction": direction, "distance": distance}


SWAP = {"kind": "relation", "relation": "swapped", "objects": [0, 1]}
LEFT_OF = {"kind": "relation", "relation": "left of", "objects": [3], "reference": [2]}


@pytest.fixture
def blocks() -> Iterator[TableScene]:
    """Four blocks beside each other."""
    models = [procedural_object("block", index) for index in range(4)]
    poses = np.array([pose_from_xyz_yaw(x, y, 0.0, 0.0) for x, y in PLACES])
    with TableScene(models, poses, 4, np.random.default_rng(0)) as table:
        yield table


def steps_of(*pairs: tuple[int, int]) -> dict[int, tuple[float, float]]:
    """Move objects to the places of others."""
    return {i: (PLACES[j][0] - PLACES[i][0], PLACES[j][1] - PLACES[i][1]) for i, j in pairs}


# --- the goal on the table -----------------------------------------------------------------------


def test_indices_are_those_of_the_first_order_whoever_takes_part(blocks):
    blocks.involve(["block 4", "block 2"])
    wanted, scene = put_on_table(blocks, goal_of(moved(3, "left", 0.1)))
    assert wanted.names == ("block 1", "block 2", "block 3", "block 4") == tuple(cloud.name for cloud in scene.objects)
    assert scene.distractors == () and wanted.movable == (3,)
    np.testing.assert_allclose(wanted.world_from_initial[:, :2, 3], PLACES, atol=0.005)
    assert blocks.names[: blocks.count] == ("block 4",)
    assert wanted.sentences == ("block 4 moved left by 10 cm",)


def test_everything_else_is_written_out_without_what_the_arm_cannot_take(blocks):
    blocks.out_of_reach = {"block 2": "no grasp fits the hand"}
    wanted, _ = put_on_table(blocks, goal_of(LEFT_OF, {"kind": "structure", "x_position": "left"}))
    assert wanted.goal.parts[1].objects == (0,) and wanted.movable == (0, 3)
    assert set(blocks.missing) == {"block 2"}
    with pytest.raises(NotBuildable, match="block 2 cannot take part: no grasp fits the hand"):
        put_on_table(blocks, goal_of(LEFT_OF, {"kind": "structure", "shape": "line"}))  # one object is no line


def test_what_the_arm_cannot_take_is_no_object_but_may_be_a_reference(blocks):
    blocks.out_of_reach = {"block 3": "no grasp fits the hand"}
    put_on_table(blocks, goal_of(LEFT_OF))
    blocks.out_of_reach = {"block 4": "out of the arm's reach"}
    with pytest.raises(NotBuildable, match="places objects that the arm cannot take: block 4, out of the arm's reach"):
        put_on_table(blocks, goal_of(LEFT_OF))


def test_what_the_arm_cannot_take_is_not_moved_to_make_room_either(blocks):
    edge = pose_from_xyz_yaw(0.45, 0.41, 0.0, 0.0)
    blocks.world.set_pose(2, edge)  # nothing fits between it and the table's edge
    planner = ResourceCache().goal_planner("geometric", None)

    def moved_for_it() -> set[str]:
        wanted, scene = put_on_table(blocks, goal_of(LEFT_OF))
        proposed = propose_goal(
            planner, "geometric", with_fixed(scene, arm_model(DEFAULT_MODEL).hand, "friction"), wanted, 0
        )
        return {cloud.name for cloud in proposed.scene.objects}

    assert moved_for_it() == {"block 3", "block 4"}
    blocks.out_of_reach = {"block 3": "out of the arm's reach"}
    with pytest.raises(NoValidGoal, match="block 4 left of block 3"):
        moved_for_it()


def test_what_has_fallen_off_cannot_be_named(blocks):
    blocks.world.set_pose(2, pose_from_xyz_yaw(0.5, 0.0, -1.0, 0.0))
    with pytest.raises(NotBuildable, match="block 3, which is no longer on the table"):
        put_on_table(blocks, goal_of(LEFT_OF))
    wanted, scene = put_on_table(blocks, goal_of(moved(3, "left", 0.1)))
    assert wanted.names == ("block 1", "block 2", "block 4") and wanted.movable == (2,) and not wanted.unseen


def test_other_indices_keep_references_to_parts():
    goal = goal_of(
        {"kind": "structure", "shape": "circle", "objects": [0, 1, 4], "around": [2]},
        {"kind": "relation", "relation": "behind", "objects": {"part": 0}, "reference": [3]},
    )
    other = renumbered(goal, {0: 5, 1: 6, 2: 7, 3: 8, 4: 9})
    assert other.parts[0].objects == (5, 6, 9) and other.parts[0].around == (7,)
    assert other.parts[1].objects == goal.parts[1].objects and other.parts[1].reference == (8,)


# --- proposals -----------------------------------------------------------------------------------


def test_what_any_arrangement_moves_takes_part_and_stays_where_an_arrangement_leaves_it(blocks):
    wanted, scene = put_on_table(blocks, goal_of(SWAP))
    swap = steps_of((0, 1), (1, 0))
    planner = Given(swap, {**swap, 2: (0.05, 0.0)})
    proposed = propose_goal(planner, "given", scene, wanted, 0)
    assert [cloud.name for cloud in proposed.scene.objects] == ["block 1", "block 2", "block 3"]
    assert [cloud.name for cloud in proposed.scene.distractors] == ["block 4"]
    assert len(planner.scene.objects) == 4
    first, second = proposed.arrangements
    np.testing.assert_array_equal(first.goal_from_initial[2], np.eye(4))
    assert second.goal_from_initial[2][0, 3] == 0.05
    chosen = [chosen_event(1, each, proposed.scene, wanted) for each in (first, second)]
    assert [goal["stays"] for goal in chosen[0].goals] == [False, False, True] and not describe_aside(chosen[0])
    assert [goal["aside"] for goal in chosen[1].goals] == [False, False, True]
    assert describe_aside(chosen[1]) == "set aside, because it stands in the way: block 3"
    assert [goal["parts"] for goal in chosen[1].goals] == [[1], [1], []]


def test_an_object_belongs_to_every_part_that_names_it(blocks):
    line = {"kind": "structure", "shape": "line", "objects": [0, 1]}
    behind = {"kind": "relation", "relation": "behind", "objects": {"part": 0}, "reference": [2]}
    wanted, _ = put_on_table(blocks, goal_of(line, behind))
    assert [wanted.parts_of(name) for name in wanted.names] == [(0, 1), (0, 1), (1,), ()]
    assert wanted.movable == (0, 1) and wanted.set_aside(["block 1", "block 3", "block 4"]) == (3,)


def test_a_goal_without_a_layout_names_its_part(blocks):
    wanted, scene = put_on_table(blocks, goal_of(SWAP))
    with pytest.raises(NoValidGoal, match="part 2 .bowl left of mug.: there is no room"):
        propose_goal(Helpless(), "helpless", scene, wanted, 0)


# --- without the arm -----------------------------------------------------------------------------


def released(table: TableScene, goal: Goal, planner: Given) -> list[Event]:
    wanted, scene = put_on_table(table, goal)
    proposed = propose_goal(planner, "given", scene, wanted, 0)
    table.involve([cloud.name for cloud in proposed.scene.objects])
    happened = []
    try:
        for event in release_in_physics(table, proposed.scene, wanted, proposed.arrangements[0]):
            happened.append(event)
    except NoValidGoal:
        pass
    return happened


def test_all_parts_are_released_and_checked(blocks):
    goal = goal_of(SWAP, LEFT_OF)
    tried, _, checked = released(blocks, goal, Given({**steps_of((0, 1), (1, 0)), 3: (0.28, 0.17)}))
    assert checked.success and len(tried.positions) == 3
    for position, place in zip(tried.positions, (PLACES[1], PLACES[0], (0.60, 0.17)), strict=True):
        np.testing.assert_allclose(position[:2], place, atol=0.02)


def test_one_part_that_does_not_hold_is_enough_to_fail(blocks):
    *_, checked = released(blocks, goal_of(SWAP, LEFT_OF), Given({**steps_of((0, 1), (1, 0)), 3: (0.28, -0.13)}))
    assert checked.failure_class == "semantic" and "left of" in checked.detail


def test_what_no_part_names_may_be_set_aside_and_nothing_else_moves_it(blocks):
    goal = goal_of(moved(0, "right", 0.2))
    *_, checked = released(blocks, goal, Given({0: (0.0, -0.2), 3: (-0.08, 0.0)}))
    assert checked.success


# --- with the arm --------------------------------------------------------------------------------


@pytest.mark.usefixtures("quick_arm")
def test_a_swap_is_built_by_way_of_a_free_place_and_what_stays_is_not_touched(blocks):
    blocks.arm.hold_by("weld")
    goal = goal_of(SWAP)
    wanted, scene = put_on_table(blocks, goal)
    proposed = propose_goal(Given(steps_of((0, 1), (1, 0))), "given", scene, wanted, 0)
    happened = list(build_with_arm(blocks, proposed.scene, wanted, proposed.arrangements, 0, film=False))
    planned = next(event for event in happened if isinstance(event, Planned))
    assert sorted(planned.order) in ([0, 0, 1], [0, 1, 1])
    assert [event.aside for event in happened if isinstance(event, Placed)].count(True) == 1
    checked = happened[-1]
    assert isinstance(checked, events.Checked) and checked.success
    poses = blocks.poses()
    np.testing.assert_allclose(poses["block 1"][:2, 3], PLACES[1], atol=0.03)
    np.testing.assert_allclose(poses["block 3"][:2, 3], PLACES[2], atol=0.01)


def test_a_goal_that_holds_already_needs_no_motion(blocks):
    wanted, scene = put_on_table(blocks, goal_of({**LEFT_OF, "objects": [0]}))
    proposed = propose_goal(Given({}), "given", scene, wanted, 0)
    happened = []
    with pytest.raises(ExecutionFailed, match="the goal was built but does not stand as asked .semantic.: .*left of"):
        for event in build_with_arm(blocks, proposed.scene, wanted, proposed.arrangements, 0, film=False):
            happened.append(event)
    planned = next(event for event in happened if isinstance(event, Planned))
    assert planned.order == () and not any(isinstance(event, Placed) for event in happened)


def test_rules_say_what_goes_into_what(blocks):
    inside = {"kind": "relation", "relation": "in", "objects": [0], "reference": [1]}
    upon = {"kind": "relation", "relation": "on", "objects": [3], "reference": [2]}
    wanted, scene = put_on_table(blocks, goal_of(inside, upon, moved(2, "left", 0.1)))
    rules = wanted.placement_rules(scene.select(wanted.movable))  # blocks 1, 3 and 4
    assert rules.into == {0: frozenset({("distractor", 0)})}
    assert rules.after == {0: frozenset(), 2: frozenset({1})}
