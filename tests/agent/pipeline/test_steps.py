"""The steps of a run where things stand on each other, where few take part, and where somebody interrupts."""

from collections.abc import Iterator

import numpy as np
import pytest

from agent import events
from agent.arm.events import Placed, PlanFailed, Planned, Stopped
from agent.errors import ExecutionFailed, NotBuildable, NoValidGoal
from agent.event_base import Event
from agent.pipeline.building import LAST_PICTURE, build_with_arm, forward_events
from agent.pipeline.event_builders import chosen_event
from agent.pipeline.proposing import propose_arrangements, propose_goal
from agent.pipeline.release import TRIED_PICTURE, release_in_physics
from agent.pipeline.table_goal import TableGoal
from agent.scenes.table_scene import TableScene
from grounding.goals.goal import Goal
from grounding.goals.parts import RelationPart
from grounding.spec import StructureSpec
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement, ObjectCloud, Scene, StructureGoal, Table
from structdiffusion.planners.geometric import GeometricPlanner
from structdiffusion.planners.goal_planner import GoalArrangement

BLOCKS = [procedural_object("block", index) for index in range(3)]


class Watched(GeometricPlanner):
    """The geometric planner, and the scene that it was shown."""

    def propose(self, scene, goal, **keywords):
        self.shown = scene
        return super().propose(scene, goal, **keywords)


def cube(name: str, x: float, y: float, bottom: float = 0.0) -> ObjectCloud:
    """A cube of 6 cm as if it were seen from all sides."""
    points = np.random.default_rng(0).uniform((-0.03, -0.03, 0.0), (0.03, 0.03, 0.06), (400, 3))
    return ObjectCloud(name, "cube", (points + (x, y, bottom)).astype(np.float32), bottom=bottom)


@pytest.fixture
def stacked() -> Iterator[TableScene]:
    """Three blocks, the second on the first."""
    poses = [pose_from_xyz_yaw(0.45, -0.1, 0.0, 0.0), pose_from_xyz_yaw(0.45, -0.1, BLOCKS[0].height, 0.0)]
    poses.append(pose_from_xyz_yaw(0.45, 0.2, 0.0, 0.0))
    with TableScene(BLOCKS, np.array(poses), 3, np.random.default_rng(0)) as table:
        yield table


def test_the_planner_sees_what_stands_on_something_lowered(stacked):
    scene, planner = stacked.look(), Watched()
    proposed = propose_arrangements(planner, "geometric", scene, StructureGoal(StructureSpec("line")), 0)
    assert [cloud.bottom for cloud in scene.objects] == pytest.approx([0.0, BLOCKS[0].height, 0.0])
    assert [cloud.bottom for cloud in planner.shown.objects] == [0.0, 0.0, 0.0]
    assert abs(planner.shown.objects[1].points[:, 2].max() - BLOCKS[1].height) < 0.01
    assert proposed.scene is scene and len(proposed.candidates) == len(proposed.arrangements) > 1


def test_the_motion_is_right_from_where_it_really_stands(stacked):
    scene = stacked.look()
    proposed = propose_arrangements(GeometricPlanner(), "geometric", scene, StructureGoal(StructureSpec("line")), 0)
    best = proposed.arrangements[0]
    for pose, motion in zip(stacked.world.poses(), best.goal_from_initial, strict=True):
        assert (motion @ pose)[2, 3] == pytest.approx(0.0, abs=0.01)  # of a line everything stands on the table
    for cloud, motion, place in zip(
        scene.objects, best.goal_from_initial, proposed.candidates[0].positions, strict=True
    ):
        assert place == pytest.approx(transform_points(motion, cloud.points).mean(axis=0), abs=1e-4)


def test_a_tower_of_what_is_a_tower_already_has_its_heights(stacked):
    proposed = propose_arrangements(
        GeometricPlanner(), "geometric", stacked.look(), StructureGoal(StructureSpec("tower")), 0
    )
    goals = proposed.arrangements[0].goal_from_initial @ np.array(stacked.world.poses())
    order = np.argsort(goals[:, 2, 3])
    heights = np.concatenate(([0.0], np.cumsum([BLOCKS[i].height for i in order])))[:3]
    assert goals[order, 2, 3] == pytest.approx(heights, abs=0.02)


def test_what_would_fall_with_another_has_to_take_part(stacked):
    stacked.involve(["block 1", "block 3"])
    with pytest.raises(NotBuildable, match="the block 2 stands on the block 1 and would fall: let the block 2 take"):
        propose_arrangements(GeometricPlanner(), "geometric", stacked.look(), StructureGoal(StructureSpec("line")), 0)
    stacked.involve(["block 2", "block 3"])  # what stands below may stay
    assert propose_arrangements(
        GeometricPlanner(), "geometric", stacked.look(), StructureGoal(StructureSpec("line")), 0
    ).candidates


def test_a_distractor_that_stands_beside_does_not_matter():
    scene = Scene((cube("a", 0.3, 0.0), cube("b", 0.4, 0.2)), distractors=(cube("c", 0.5, -0.2, 0.06),))
    assert propose_arrangements(
        GeometricPlanner(), "geometric", scene, StructureGoal(StructureSpec("line")), 0
    ).candidates


def test_a_circle_needs_three():
    scene = Scene((cube("a", 0.3, 0.0), cube("b", 0.5, 0.2)))
    with pytest.raises(NotBuildable, match="a circle needs at least 3 objects, but 2 take part"):
        propose_arrangements(GeometricPlanner(), "geometric", scene, StructureGoal(StructureSpec("circle")), 0)
    three = Scene((*scene.objects, cube("c", 0.4, -0.2)))
    assert propose_arrangements(
        GeometricPlanner(), "geometric", three, StructureGoal(StructureSpec("circle")), 0
    ).candidates


def test_no_layout_is_no_valid_goal():
    """Two slabs that are each wider than the table."""
    slabs = [ObjectCloud(name, "slab", cube(name, 0.0, 0.0).points * (15.0, 15.0, 1.0)) for name in "ab"]
    with pytest.raises(NoValidGoal, match="the model 'geometric' proposed no valid arrangement"):
        propose_arrangements(
            GeometricPlanner(), "geometric", Scene(tuple(slabs)), StructureGoal(StructureSpec("line")), 0
        )


def test_the_same_seed_proposes_the_same():
    scene = Scene((cube("a", 0.3, 0.0), cube("b", 0.5, 0.2)))
    first, again, other = (
        propose_arrangements(GeometricPlanner(), "geometric", scene, StructureGoal(StructureSpec("line")), seed)
        for seed in (1, 1, 2)
    )
    assert first.candidates == again.candidates != other.candidates


# --- interruptions -------------------------------------------------------------------------------


def work(happened: list[str]) -> Iterator[Event]:
    """An arm at work that tells that it was stopped."""
    try:
        for number in range(3):
            yield events.Noted(f"step {number}")
    except KeyboardInterrupt:
        happened.append("stopping")
        yield Stopped(None, "", False, True)
        raise
    finally:
        happened.append("ended")


def test_an_interruption_is_handed_on_and_its_events_are_sent():
    happened: list[str] = []
    given = forward_events(work(happened), lambda event: iter((event, events.Noted("more"))))
    assert [next(given).message for _ in range(3)] == ["step 0", "more", "step 1"]
    assert happened == []
    assert given.throw(KeyboardInterrupt()) == Stopped(None, "", False, True)
    assert happened == ["stopping"]
    assert next(given).message == "more"
    with pytest.raises(KeyboardInterrupt):
        next(given)
    assert happened == ["stopping", "ended"] and list(given) == []


def test_an_interruption_while_more_is_made_of_an_event_is_handed_on_too():
    def more(event: Event) -> Iterator[Event]:
        yield event
        if getattr(event, "message", "") == "step 1":
            raise KeyboardInterrupt

    happened: list[str] = []
    got = []
    with pytest.raises(KeyboardInterrupt):
        for event in forward_events(work(happened), more):
            got.append(event)
    assert got == [events.Noted("step 0"), events.Noted("step 1"), Stopped(None, "", False, True)]
    assert happened == ["stopping", "ended"]


def test_undisturbed_everything_is_forwarded_in_turn():
    happened: list[str] = []
    got = list(forward_events(work(happened), lambda event: iter((event,))))
    assert got == [events.Noted(f"step {number}") for number in range(3)]
    assert happened == ["ended"]


# --- building ------------------------------------------------------------------------------------


def test_ranks_number_the_events_of_plans(table):
    """The first of two arrangements is out of reach; by their ranks they are the fourth and the second."""
    scene = table.look()
    start = np.array(table.world.poses())
    near = start.copy()
    near[:, :2, 3] = [(0.42, -0.12), (0.42, 0.15)]
    far = near.copy()
    far[:, 0, 3] = 1.6
    choices = [Arrangement(goals @ np.linalg.inv(start), {"total": 0.5}) for goals in (far, near)]
    happened = []
    building = build_with_arm(table, scene, StructureSpec("line"), choices, 0, ranks=[4, 2], film=False)
    for event in building:
        happened.append(event)
        if isinstance(event, Planned):
            break
    building.close()
    failed, chosen, planned = happened
    assert isinstance(failed, PlanFailed) and failed.arrangement == 3
    assert isinstance(chosen, events.Chosen) and chosen.rank == 2 and chosen.arrangement is choices[1]
    assert isinstance(planned, Planned) and planned.arrangement == 1


def test_without_ranks_they_are_numbered_in_order(table):
    scene, start = table.look(), np.array(table.world.poses())
    motions = np.tile(np.eye(4), (2, 1, 1))
    motions[:, 0, 3] = 1.2
    happened = []
    building = build_with_arm(table, scene, StructureSpec("line"), [Arrangement(motions)] * 2, 0, film=False)
    with pytest.raises(ExecutionFailed, match="0 of 2 objects were placed: no arrangement could be planned"):
        for event in building:
            happened.append(event)
    assert [event.arrangement for event in happened if isinstance(event, PlanFailed)] == [0, 1]
    assert not any(isinstance(event, events.Chosen | Placed) for event in happened)
    np.testing.assert_allclose(table.world.poses(), start, atol=0.002)


def test_the_last_picture_knows_how_far_everything_has_moved(table):
    scene, start = table.look(), np.array(table.world.poses())
    motions = np.tile(np.eye(4), (2, 1, 1))
    motions[:, 0, 3] = 1.2  # out of reach
    pushed = pose_from_xyz_yaw(0.5, 0.0, 0.0, 0.7)
    happened = []
    with pytest.raises(ExecutionFailed):
        for event in build_with_arm(table, scene, StructureSpec("line"), [Arrangement(motions)], 0, film=False):
            if isinstance(event, PlanFailed):
                table.world.set_pose(1, pushed)
            happened.append(event)
    last = happened[-1]
    assert isinstance(last, events.Pictured) and last.name == LAST_PICTURE
    for name, pose, now in zip(table.names, start, (start[0], pushed), strict=True):
        np.testing.assert_allclose(last.motions[name] @ pose, now, atol=0.003)


def test_planning_can_be_interrupted_and_moves_nothing(table):
    scene, start = table.look(), np.array(table.world.poses())
    motions = np.tile(np.eye(4), (2, 1, 1))
    motions[0, 1, 3] = 0.1
    checks, happened = [], []

    def on_check():
        checks.append(1)
        if len(checks) == 50:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        for event in build_with_arm(table, scene, StructureSpec("line"), [Arrangement(motions)], 0, on_check=on_check):
            happened.append(event)
    assert happened == [] and len(checks) == 50
    np.testing.assert_allclose(table.world.poses(), start, atol=1e-6)


# --- trying without the arm ----------------------------------------------------------------------


def test_what_was_tried_is_sent_and_pictured_and_the_table_stays(table):
    scene, start = table.look(), np.array(table.world.poses())
    before = table.picture()
    goals = start.copy()
    goals[:, :2, 3] = [(0.4, 0.3), (0.4, 0.1)]
    arrangement = Arrangement(goals @ np.linalg.inv(start))
    tried, pictured, checked = release_in_physics(table, scene, StructureSpec("line"), arrangement)
    assert isinstance(tried, events.Tried) and isinstance(checked, events.Checked) and checked.success
    expected = chosen_event(1, arrangement, scene).goals
    for position, goal in zip(tried.positions, expected, strict=True):
        np.testing.assert_allclose(position, goal["position"], atol=0.01)
    assert pictured.name == TRIED_PICTURE and "unchanged" in pictured.caption
    assert list(pictured.motions) == list(table.names)
    for motion, pose, goal in zip(pictured.motions.values(), start, goals, strict=True):
        np.testing.assert_allclose(motion @ pose, goal, atol=0.01)
    for place in goals[:, :3, 3] + (0, 0, 0.02):  # a box is where none was
        column, row = table.world.camera.pixels(place).astype(int)
        assert np.abs(pictured.image[row, column].astype(int) - before[row, column]).max() > 30
    np.testing.assert_array_equal(table.world.poses(), start)
    assert (table.picture() == before).all()


def test_what_failed_when_tried_is_shown_too(table):
    """The second box is released into the first: it is not placed, and stays where it stands."""
    scene, start = table.look(), np.array(table.world.poses())
    goals = start.copy()
    goals[:, :2, 3] = [(0.4, 0.0), (0.4, 0.01)]
    arrangement = Arrangement(goals @ np.linalg.inv(start))
    with pytest.raises(NoValidGoal, match="does not hold"):
        list(release_in_physics(table, scene, StructureSpec("line"), arrangement))
    happened = list(_until_failure(release_in_physics(table, scene, StructureSpec("line"), arrangement)))
    tried, pictured, checked = happened
    assert not checked.success and checked.failure_class == "intersection"
    assert np.isfinite(tried.positions).all() and len(tried.positions) == 2
    assert pictured.image.shape == (480, 640, 3)


def _until_failure(work: Iterator[Event]) -> Iterator[Event]:
    try:
        yield from work
    except NoValidGoal:
        return


class Moving:
    """A planner of goals whose arrangements move these objects, one after another."""

    def __init__(self, *moved):
        self.moved = moved

    def propose(self, scene, goal, **keywords):
        motions = np.tile(np.eye(4), (len(scene.objects), 1, 1))
        return [GoalArrangement(moved, (), motions, {"total": 1.0}) for moved in self.moved]


def test_to_make_room_nothing_is_moved_on_which_something_stands():
    clouds = [cube("plate", 0.4, 0.0), cube("bowl", 0.4, 0.0, 0.06), cube("spoon", 0.6, 0.2)]
    wanted = TableGoal(
        Goal((RelationPart("left of", (2,), (0,)),)), ("plate", "bowl", "spoon"), np.tile(np.eye(4), (3, 1, 1))
    )
    scene = Scene(tuple(clouds), Table())
    proposed = propose_goal(Moving((0, 2), (2,), (0, 1, 2)), "geometric", scene, wanted, 0)
    assert len(proposed.arrangements) == 2
    with pytest.raises(NotBuildable, match="the bowl stands on the plate and would fall"):
        propose_goal(Moving((0, 2)), "geometric", scene, wanted, 0)
