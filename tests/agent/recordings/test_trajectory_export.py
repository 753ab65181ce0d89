"""The commands of the arm on the twin: speeds, continuity, where it begins, and what is read back from the files."""

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from agent.arm.arm_model import arm_model
from agent.arm.build_listeners import BuildListeners
from agent.arm.executor import build_structure
from agent.arm.jaco_hand import FINGER_SPEED, FINGERS
from agent.arm.state import ArmState
from agent.errors import BadInput, UsageError
from agent.recordings.trajectory_export import TrajectoryLog, check_export, write_trajectory
from agent.scenes.table_scene import TableScene
from agent.scenes.workcell import Workcell
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement
from tests.agent.recordings.bag_making import joints, session, write_bag

MODEL, PREFIX = arm_model("j2n6s300"), "left_"
HOME = np.array((4.8046852, 2.92482, 1.002, 4.2031852, 1.4458, 1.3233))
WOUND = HOME + 2 * math.pi * np.array((2, 0, 0, -3, 0, 0))
CLOSED = 0.9


@pytest.fixture(scope="module")
def log() -> TrajectoryLog:
    """Of a block that is moved, by an arm that had wound itself up before."""
    start, goal = pose_from_xyz_yaw(0.42, -0.15, 0.0, 0.3), pose_from_xyz_yaw(0.47, 0.1, 0.0, 0.3)
    angles = dict(zip((*MODEL.joints, *FINGERS), (*WOUND, CLOSED, CLOSED, CLOSED), strict=True))
    arm, log = ArmState(MODEL.name, angles, PREFIX), TrajectoryLog()
    models, workcell = [procedural_object("block", 1)], Workcell(arm=arm)
    with TableScene(models, start[None], 1, np.random.default_rng(0), workcell) as table:
        scene, arrangement = table.look(), Arrangement((goal @ np.linalg.inv(start))[None])
        rng, listeners = np.random.default_rng(0), BuildListeners(log=log)
        for _ in build_structure(table.world, table.arm, scene, [arrangement], rng=rng, listeners=listeners):
            pass
        assert np.linalg.norm(table.world.pose(0)[:2, 3] - goal[:2, 3]) < 0.03
    return log


def test_it_begins_where_the_recording_ends_and_goes_on_where_it_was(log):
    motions = log.motions(MODEL)
    np.testing.assert_allclose(motions[0].joints[0], WOUND, atol=1e-9)
    np.testing.assert_allclose(motions[0].fingers[0], [CLOSED] * 3)
    for before, after in zip(motions, motions[1:]):
        np.testing.assert_array_equal(before.joints[-1], after.joints[0])
        np.testing.assert_array_equal(before.fingers[-1], after.fingers[0])
        assert after.start == pytest.approx(before.start + before.times[-1])


def test_each_motion_has_its_name(log):
    names = [motion.name for motion in log.motions(MODEL)]
    names = names[names.index("reach block") :]
    assert names[:4] == ["reach block", "approach block", "close hand", "lift block"]
    assert names[4:] == ["transfer block", "lower block", "open hand", "retreat", "fold", "open hand"]
    assert log.motions(MODEL)[0].name == "fold"


def test_no_joint_is_faster_than_its_maker_allows(log):
    fastest = np.zeros(6)
    for motion in log.motions(MODEL):
        steps = np.diff(motion.times)[:, None]
        assert (steps > 0.0).all() and steps.max() < 1.5
        speeds = np.abs(np.diff(motion.joints, axis=0)) / steps
        assert (speeds <= MODEL.velocity).all()
        assert (np.abs(np.diff(motion.fingers, axis=0)) / steps <= FINGER_SPEED).all()
        fastest = np.maximum(fastest, speeds.max(axis=0))
    assert fastest.max() > 0.5  # rad/s: it does move


def test_the_twin_moved_as_it_was_told(log):
    for motion in log.motions(MODEL):
        commanded = motion.joints
        lag = np.abs(motion.moved[:, :6] - commanded).max()
        assert lag < 0.05, motion.name


def test_json_says_the_same(log, tmp_path):
    path = tmp_path / "deep" / "arm.json"
    assert write_trajectory(log, path, PREFIX, MODEL)
    read, motions = json.loads(path.read_text()), log.motions(MODEL)
    assert (read["schema_version"], read["model"]) == (1, "j2n6s300")
    assert read["joints"][0] == "left_joint_1" and read["fingers"][2] == "left_joint_finger_3"
    assert [segment["name"] for segment in read["segments"]] == [motion.name for motion in motions]
    for segment, motion in zip(read["segments"], motions, strict=True):
        assert segment["start"] == pytest.approx(motion.start, abs=1e-6)
        assert (segment["arm"] is None) == (motion.name in ("open hand", "close hand"))
        if segment["arm"] is not None:
            np.testing.assert_allclose(segment["arm"]["positions"], motion.joints, atol=1e-6)
            assert not any(segment["arm"]["velocities"][0] + segment["arm"]["velocities"][-1])
            assert (np.abs(segment["arm"]["velocities"]) <= MODEL.velocity).all()
            assert segment["arm"]["times"][-1] == pytest.approx(segment["duration"])
    closing = next(segment["hand"] for segment in read["segments"] if segment["name"] == "close hand")
    turns = np.array(closing["turns"])
    commanded = np.minimum(closing["positions"], math.radians(80))
    np.testing.assert_allclose(np.radians(turns * 80 / 6800), commanded, atol=1e-4)
    assert 0.0 <= turns.min() < turns.max() <= 6800.0


@pytest.mark.parametrize("name", ["arm.bag", "arm.mcap", "arm"])
def test_bags_are_read_back(log, tmp_path, name):
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    path, motions = tmp_path / name, log.motions(MODEL)
    for _ in range(2):  # the second replaces the first
        assert write_trajectory(log, path, PREFIX, MODEL)
    arm, hand, moved = [], [], []
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        topics = {connection.topic: connection.msgtype for connection in reader.connections}
        for connection, when, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            assert abs(stamp - when) <= 1
            into = {"trajectory_controller": arm, "fingers": hand, "out": moved}[connection.topic.split("/")[2]]
            into.append((stamp, message))
    assert topics == {
        "/left_driver/trajectory_controller/command": "trajectory_msgs/msg/JointTrajectory",
        "/left_driver/fingers/command": "trajectory_msgs/msg/JointTrajectory",
        "/left_driver/out/joint_state": "sensor_msgs/msg/JointState",
    }
    begin = moved[0][0]
    arm_motions = [motion for motion in motions if motion.name not in ("open hand", "close hand")]
    for (stamp, message), motion in zip(arm, arm_motions, strict=True):
        assert message.joint_names == [PREFIX + joint for joint in MODEL.joints]
        assert (stamp - begin) * 1e-9 == pytest.approx(motion.start, abs=1e-6)
        np.testing.assert_allclose([point.positions for point in message.points], motion.joints)
        times = [point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec for point in message.points]
        np.testing.assert_allclose(times, motion.times, atol=1e-8)
    np.testing.assert_allclose(arm[0][1].points[0].positions, WOUND)
    assert len(hand) >= 4 and hand[0][1].joint_names == [f"left_joint_finger_{k}" for k in (1, 2, 3)]
    assert len(moved[0][1].name) == len(moved[0][1].position) == 12
    np.testing.assert_allclose(moved[0][1].position[:6], WOUND, atol=1e-6)


def test_nothing_is_written_of_an_arm_that_rests(tmp_path):
    assert not write_trajectory(TrajectoryLog(), tmp_path / "arm.json", PREFIX, MODEL)
    assert list(tmp_path.iterdir()) == []


def test_where_no_trajectory_can_be_written(log, tmp_path):
    with pytest.raises(UsageError, match="'arm.csv'; legal: a file that ends in .json, .bag"):
        check_export(Path("arm.csv"))
    (tmp_path / "notes").mkdir()
    write_bag(tmp_path / "session.bag", session())
    write_bag(tmp_path / "joints.bag", [joints()])
    shutil.copy(tmp_path / "session.bag", tmp_path / "session.json")
    (tmp_path / "mine.json").write_text('{"schema_version": 1}')
    (tmp_path / "file").write_text("mine")
    for name in ("notes", "session.bag", "joints.bag", "session.json", "mine.json", "file"):
        before = (tmp_path / name).read_bytes() if name != "notes" else b""
        with pytest.raises(
            UsageError, match=f"must be a new file, or replace another one, but .*{name}' is something else"
        ):
            write_trajectory(log, tmp_path / name, PREFIX, MODEL)
        assert name == "notes" or (tmp_path / name).read_bytes() == before
    for path in (tmp_path / "file" / "arm.json", Path("/proc/arm.json")):
        with pytest.raises(BadInput, match=f"cannot write '{path}': "):
            check_export(path)


def test_a_trajectory_replaces_another_one(log, tmp_path):
    for _ in range(2):
        assert write_trajectory(log, tmp_path / "arm.json", PREFIX, MODEL)
