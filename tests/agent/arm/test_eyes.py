"""What the camera tells of the table while the arm builds, and what of it is a surprise."""

import math

import numpy as np
import pytest

from agent.arm.eyes import ON_HEAD, ON_SIDE, Eyes
from agent.arm.monitor import Monitor
from agent.arm.simulated_arm import SimulatedArm
from agent.arm.standing_watch import StandingWatch, standing_at
from structdiffusion.completion.surface import completed_scene
from structdiffusion.geometry import pose_from_xyz_rpy, pose_from_xyz_yaw, raised, tilt_between
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.simulation.world import TABLE, TabletopWorld

KINDS = ("can", "bottle", "box")
PLACES = ((0.35, -0.25, 0.4), (0.45, 0.0, 0.0), (0.5, 0.25, 1.0))
AWAY = pose_from_xyz_yaw(0.0, 0.0, -20.0, 0.0)


class Table:
    """Three objects that the camera has seen, and a fourth out of sight."""

    def __init__(self, world):
        self.world = world
        world.settle()
        self.scene = world.observe(np.random.default_rng(0), range(len(KINDS)))
        self.arm = SimulatedArm(world.client)
        self.eyes = Eyes(world, self.arm, self.scene, completed_scene(self.scene), np.random.default_rng(1))
        self.monitor = Monitor(self.eyes)
        world.add(procedural_object("candle", 3), AWAY)
        world.hold(3)

    def changes(self, expected=None, **touched):
        self.eyes.look(expected or {})
        return [(change.index, change.what) for change in self.monitor.changes(expected or {}, **touched)]


@pytest.fixture
def table():
    models = [procedural_object(kind, index) for index, kind in enumerate(KINDS)]
    with TabletopWorld(models, [pose_from_xyz_yaw(x, y, 0.0, yaw) for x, y, yaw in PLACES]) as world:
        yield Table(world)


def test_the_arm_is_in_no_picture(table):
    picture = table.eyes.camera.picture()
    arm = picture.segmentation == table.arm.body
    assert arm.sum() > 1000 and not np.isfinite(picture.depth[arm]).any() and not np.isfinite(picture.points[arm]).any()
    objects = np.isin(picture.segmentation, table.world.bodies[:3])
    assert np.isfinite(picture.depth[objects]).mean() > 0.97  # the camera itself loses one pixel in a hundred


def test_where_nothing_happens_nothing_has_moved(table):
    for _ in range(3):
        assert table.changes() == []
    assert all(np.array_equal(motion, np.eye(4)) for motion in table.eyes.motions)


def test_a_push_is_noticed_once(table):
    pushed = pose_from_xyz_yaw(0.035, -0.02, 0.0, 0.0)
    table.world.set_pose(0, pushed @ table.world.pose(0))
    assert table.changes() == [(0, "moved")]
    assert table.changes() == []
    off = table.eyes.middle(0, table.eyes.motions[0]) - table.eyes.middle(0, pushed)
    assert np.linalg.norm(off) < 0.01


def test_what_the_arm_has_moved_itself_is_no_surprise(table):
    moved = pose_from_xyz_yaw(0.1, 0.05, 0.0, 0.0)
    table.world.set_pose(0, moved @ table.world.pose(0))
    assert table.changes({0: moved}) == []
    table.world.set_pose(2, pose_from_xyz_yaw(0.0, 0.02, 0.0, 0.0) @ table.world.pose(2))
    assert table.changes(touched=2) == []
    table.world.set_pose(2, pose_from_xyz_yaw(0.0, 0.05, 0.0, 0.0) @ table.world.pose(2))
    assert table.changes(touched=2) == [(2, "moved")]  # more than the fingers would push it


def test_what_is_round_is_at_its_goal_however_it_was_turned(table):
    """The camera saw one side of it alone, which is on the other side then."""
    x, y, _ = PLACES[0]
    goal = pose_from_xyz_yaw(0.15, 0.1, 0.0, 0.0)
    put = goal @ pose_from_xyz_yaw(x, y, 0.0, math.pi) @ pose_from_xyz_yaw(-x, -y, 0.0, 0.0)
    table.world.set_pose(0, put @ table.world.pose(0))
    assert table.changes({0: put}) == []
    assert standing_at(table.eyes, 0, goal).displacement < 0.01


def test_what_is_gone_is_not_back_while_something_else_hides_its_place(table):
    table.world.set_pose(0, AWAY)
    assert table.changes() == [(0, "gone")]
    x, y, yaw = PLACES[2]
    there = pose_from_xyz_yaw(PLACES[0][0] - 0.03, PLACES[0][1], 0.0, 1.2)
    motion = there @ np.linalg.inv(pose_from_xyz_yaw(x, y, 0.0, yaw))
    table.world.set_pose(2, motion @ table.world.pose(2))
    table.eyes.look({2: motion})
    assert table.eyes.gone == {0} and not table.eyes.hidden


def test_what_is_taken_away_is_gone_and_may_come_back(table):
    stood = table.world.pose(1)
    table.world.set_pose(1, AWAY)
    assert table.changes() == [(1, "gone")] and table.eyes.gone == {1}
    assert table.eyes.cloud(1)[:, 0].max() < -4.0  # far from all that is planned
    table.world.set_pose(1, stood)
    assert table.changes() == [(1, "appeared")] and not table.eyes.gone


def test_what_is_put_there_is_something_unknown(table):
    table.world.set_pose(3, pose_from_xyz_yaw(0.4, 0.15, 0.0, 0.0))
    assert table.changes() == [(None, "appeared")]
    (cloud,) = table.eyes.unknown
    assert np.linalg.norm(cloud[:, :2].mean(axis=0) - (0.4, 0.15)) < 0.03
    assert [one.name for one in table.eyes.scene_now().distractors] == ["something 1"]
    assert table.changes() == []


def test_what_is_tipped_over_has_fallen_and_has_its_foot_where_it_stood(table):
    x, y, _ = PLACES[1]
    radius = float(np.abs(np.concatenate(table.world.models[1].hulls)[:, 0]).max())
    table.world.set_pose(1, pose_from_xyz_rpy((x, y + radius, radius), (-math.pi / 2, 0.0, 0.0)))
    table.world.hold(1)  # it would roll
    assert table.changes() == [(1, "fallen")]
    motion = table.eyes.motions[1]
    assert abs(math.degrees(tilt_between(motion, np.eye(4))) - 90) < 15
    assert motion[1, 2] > 0.9 and not table.eyes.unclear  # its top points to the left, where it fell


def test_what_is_placed_out_of_sight_is_not_taken_to_stand(table):
    """It rolled under the picture's edge, say: nothing shows it, and nothing refutes it."""
    out = pose_from_xyz_yaw(3.0, 0.0, 0.0, 0.0)
    table.world.set_pose(0, out @ table.world.pose(0))
    table.world.hold(0)
    watch = StandingWatch(table.eyes)
    table.changes({0: out})
    assert table.eyes.unconfirmed == {0}
    assert watch.place(0, out, TABLE)[0] == "cannot be seen where it was put"


def test_what_is_put_on_top_of_something_known_is_unknown_and_takes_nothing_from_it(table):
    x, y, _ = PLACES[0]
    height = table.world.models[0].height
    watch = StandingWatch(table.eyes)
    watch.place(0, np.eye(4), TABLE)
    table.world.set_pose(3, pose_from_xyz_yaw(x, y, height, 0.0))
    assert table.changes() == [(None, "appeared")]
    (cloud,) = table.eyes.unknown
    assert np.percentile(cloud[:, 2], 5) > height - 0.02  # it alone, and not what it stands on
    assert list(watch.changes("nothing")) == []


@pytest.mark.parametrize("kind, index, alike", [("block", 6, True), ("bottle", 1, False), ("box", 2, False)])
def test_what_may_have_rolled_over_and_looks_the_same_then_is_not_sure_to_stand(kind, index, alike):
    """A block of 36, 40 and 38 mm on its side looks as if it stood; a bottle does not."""
    pushed = pose_from_xyz_yaw(0.05, 0.03, 0.0, 0.0)
    with TabletopWorld([procedural_object(kind, index)], [pose_from_xyz_yaw(0.4, 0.0, 0.0, 0.3)]) as world:
        world.settle()
        scene = world.observe(np.random.default_rng(0))
        eyes = Eyes(world, SimulatedArm(world.client), scene, completed_scene(scene), np.random.default_rng(1))
        world.set_pose(0, pose_from_xyz_yaw(0.01, 0.0, 0.0, 0.0) @ world.pose(0))
        eyes.look({})
        assert not eyes.doubts  # it may not have rolled over on so short a way
        world.set_pose(0, pushed @ world.pose(0))
        eyes.look({})
        assert eyes.doubts == ({0: ON_SIDE} if alike else {})
        trouble, _ = StandingWatch(eyes).place(0, eyes.motions[0], TABLE)
        assert trouble == (ON_SIDE if alike else "")


def test_what_leans_does_not_stand():
    """A low can that leans by 20 degrees is as high as one that stands."""
    with TabletopWorld([procedural_object("can", 37)], [pose_from_xyz_yaw(0.4, 0.0, 0.0, 0.0)]) as world:
        world.settle()
        scene = world.observe(np.random.default_rng(0))
        eyes = Eyes(world, SimulatedArm(world.client), scene, completed_scene(scene), np.random.default_rng(1))
        world.set_pose(0, pose_from_xyz_rpy((0.5, 0.1, 0.04), (math.radians(20), 0.0, 0.0)))
        world.hold(0)
        eyes.look({0: pose_from_xyz_yaw(0.1, 0.1, 0.03, 0.0)})
        assert math.degrees(tilt_between(eyes.motions[0], np.eye(4))) == pytest.approx(20, abs=3)


@pytest.mark.parametrize("kind, index, doubt", [("can", 4, {0: ON_HEAD}), ("jar", 5, {})])
def test_what_fell_out_of_the_hand_may_stand_on_its_head(kind, index, doubt):
    """A can has two ends alike; what was pushed along the table does not come to stand on its head."""
    with TabletopWorld([procedural_object(kind, index)], [pose_from_xyz_yaw(0.4, 0.0, 0.0, 0.3)]) as world:
        world.settle()
        scene = world.observe(np.random.default_rng(0))
        eyes = Eyes(world, SimulatedArm(world.client), scene, completed_scene(scene), np.random.default_rng(1))
        world.set_pose(0, pose_from_xyz_yaw(0.0, 0.1, 0.0, 0.0) @ world.pose(0))
        eyes.look({})
        assert not eyes.doubts
        eyes.look({}, dropped=0)
        assert eyes.doubts == doubt


def test_what_stands_in_the_hollow_of_a_plate_rests_on_it():
    """It stands 2 cm lower than on the plate's rim, where a solid plate would carry it."""
    models = [procedural_object("plate", 36), procedural_object("block", 6)]
    with TabletopWorld(
        models, [pose_from_xyz_yaw(0.5, 0.0, 0.0, 0.0), pose_from_xyz_yaw(0.35, 0.3, 0.0, 0.0)]
    ) as world:
        world.settle()
        first = world.pose(1)
        scene = world.observe(np.random.default_rng(0))
        eyes = Eyes(world, SimulatedArm(world.client), scene, completed_scene(scene), np.random.default_rng(1))
        world.set_pose(1, pose_from_xyz_yaw(0.5, 0.0, models[0].height, 0.0))
        world.settle(1.0)
        now = world.pose(1) @ np.linalg.inv(first)
        assert world.pose(1)[2, 3] < models[0].height - 0.015
        eyes.look({1: now})
        assert StandingWatch(eyes).place(1, raised(now, 0.023), 0) == ("", "plate")
