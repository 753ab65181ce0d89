"""A recorded session of the simulated arm says what the simulation knows."""

import math
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from scipy.spatial.transform import Rotation

from agent.arm.arm_model import ARM_MODELS
from agent.arm.visual_shapes import link_poses
from agent.pipeline.table_to_record import TableToRecord, recordable_table
from agent.recordings import example_path
from agent.recordings.load import read_recording
from agent.scenes.files import write_scene
from agent.scenes.object_placement import load_scene
from agent.scenes.record_bag import record_session, ros_intrinsics
from agent.scenes.table_scene import TableScene, drawing_and_noise
from structdiffusion.geometry import transform_points
from structdiffusion.simulation.depth_camera import DROPPED_PIXELS, measured_depth

SCENE = example_path().with_suffix(".yaml")


def spoken(path: Path) -> dict[str, list[tuple[float, object]]]:
    """topic -> (seconds since the first message, message)."""
    said = defaultdict(list)
    with AnyReader([path]) as reader:
        for connection, time, raw in reader.messages():
            when = (time - reader.start_time) / 1e9
            said[connection.topic].append((when, reader.deserialize(raw, connection.msgtype)))
    return said


def chain(said: dict[str, list[tuple[float, object]]], frame: str) -> np.ndarray:
    """(4, 4) of a frame in the root of tf, by the transforms alone."""
    hung = {}
    for _, message in [*said["/tf_static"], *said["/tf"]]:
        for entry in message.transforms:
            at, q = entry.transform.translation, entry.transform.rotation
            pose = np.eye(4)
            pose[:3, :3] = Rotation.from_quat((q.x, q.y, q.z, q.w)).as_matrix()
            pose[:3, 3] = at.x, at.y, at.z
            hung[entry.child_frame_id] = entry.header.frame_id, pose
    found = np.eye(4)
    while frame in hung:
        frame, pose = hung[frame]
        found = pose @ found
    assert frame == "world"
    return found


@pytest.fixture(scope="module")
def table() -> Iterator[TableScene]:
    with recordable_table(TableToRecord(str(SCENE))) as found:
        yield found.table


@pytest.fixture(scope="module")
def session(table: TableScene, tmp_path_factory) -> dict[str, list[tuple[float, object]]]:
    out = tmp_path_factory.mktemp("session") / "out.bag"
    record_session(table, out, np.random.default_rng(0), seconds=0.4, rate=10)
    return spoken(out)


def test_topics_types_and_rates(session):
    driver = "/j2s7s300_driver/out"
    types = {topic: (messages[0][1].__msgtype__, len(messages)) for topic, messages in session.items()}
    assert types == {
        "/camera/color/image_raw": ("sensor_msgs/msg/Image", 4),
        "/camera/color/camera_info": ("sensor_msgs/msg/CameraInfo", 4),
        "/camera/aligned_depth_to_color/image_raw": ("sensor_msgs/msg/Image", 4),
        "/camera/aligned_depth_to_color/camera_info": ("sensor_msgs/msg/CameraInfo", 4),
        f"{driver}/joint_state": ("sensor_msgs/msg/JointState", 4),
        f"{driver}/joint_angles": ("kinova_msgs/msg/JointAngles", 4),
        f"{driver}/finger_position": ("kinova_msgs/msg/FingerPosition", 4),
        f"{driver}/tool_pose": ("geometry_msgs/msg/PoseStamped", 4),
        "/tf": ("tf2_msgs/msg/TFMessage", 4),
        "/tf_static": ("tf2_msgs/msg/TFMessage", 1),
    }
    assert [when for when, _ in session[f"{driver}/joint_state"]] == pytest.approx([0, 0.1, 0.2, 0.3])


def test_colours_are_the_cameras(session, table):
    seen = table.world.look()
    for _, message in session["/camera/color/image_raw"]:
        assert (message.encoding, message.header.frame_id) == ("rgb8", "camera_color_optical_frame")
        assert np.array_equal(message.data.reshape(480, 640, 3), seen.color)


def test_depths_are_the_cameras_with_its_noise_anew(session, table):
    seen = table.world.look()
    depths = []
    for _, message in session["/camera/aligned_depth_to_color/image_raw"]:
        assert (message.encoding, message.is_bigendian, message.step) == ("16UC1", 0, 1280)
        depths.append(message.data.view("<u2").reshape(480, 640) / 1000)
    for depth in depths:
        both = (depth > 0) & np.isfinite(seen.depth)
        assert not (depth > 0)[np.isnan(seen.depth)].any()
        assert np.isfinite(seen.depth).sum() - both.sum() == pytest.approx(DROPPED_PIXELS * both.sum(), rel=0.1)
        error = (depth - seen.depth)[both]
        assert abs(error.mean()) < 1e-4 and 0.0012 < error.std() < 0.0035
    assert not np.array_equal(depths[0], depths[1])


def test_depth_is_rounded_to_the_millimetre(session, table):
    depth = measured_depth(table.world.look().depth, np.random.default_rng(0))
    first = session["/camera/aligned_depth_to_color/image_raw"][0][1].data.view("<u2").reshape(480, 640)
    assert np.array_equal(first > 0, np.isfinite(depth))
    assert np.nanmax(np.abs(first / 1000 - depth)[first > 0]) <= 0.0005 + 1e-9


def test_the_lens_counts_pixels_as_ros_does(session, table):
    info = session["/camera/aligned_depth_to_color/camera_info"][0][1]
    assert np.allclose(info.K.reshape(3, 3), ros_intrinsics(table.world.camera), atol=1e-12)
    assert (info.K[2], info.K[5]) == (319.5, 239.5)


def test_tf_stands_as_the_simulation(session, table):
    base_from_world = np.linalg.inv(table.arm.kinematics.world_from_base)
    camera = chain(session, "camera_color_optical_frame")
    assert np.abs(camera - base_from_world @ table.world.camera.world_from_camera).max() < 1e-6
    assert np.array_equal(chain(session, "j2s7s300_link_base"), np.eye(4))
    poses = link_poses(table.arm)
    for name, link in (
        [("j2s7s300_end_effector", table.arm.end_effector)]
        + [(f"j2s7s300_link_{k + 1}", joint) for k, joint in enumerate(table.arm.joints)]
        + [(f"j2s7s300_link_finger_tip_{k + 1}", tip) for k, tip in enumerate(table.arm.tips)]
    ):
        assert np.abs(chain(session, name) - base_from_world @ poses[link]).max() < 1e-6, name


def test_the_driver_says_how_the_arm_stands(session, table):
    driver = "/j2s7s300_driver/out"
    state = session[f"{driver}/joint_state"][0][1]
    joints, fingers = table.arm.configuration(), table.arm.finger_angles()
    assert state.header.frame_id == ""
    assert state.name == [f"j2s7s300_joint_{k}" for k in range(1, 8)] + [
        f"j2s7s300_joint_{part}_{k}" for part in ("finger", "finger_tip") for k in (1, 2, 3)
    ]
    assert np.array_equal(state.position, [*joints, *fingers, 0, 0, 0])
    angles = session[f"{driver}/joint_angles"][0][1]
    assert [getattr(angles, f"joint{k}") for k in range(1, 8)] == pytest.approx(np.degrees(joints), rel=1e-6)
    turns = session[f"{driver}/finger_position"][0][1]
    assert turns.finger1 == pytest.approx(math.degrees(fingers[0]) * 85, rel=1e-6)
    tool = session[f"{driver}/tool_pose"][0][1]
    assert tool.header.frame_id == "j2s7s300_link_base"
    at = chain(session, "j2s7s300_end_effector")[:3, 3]
    assert [tool.pose.position.x, tool.pose.position.y, tool.pose.position.z] == pytest.approx(at)


@pytest.mark.parametrize("suffix", [".bag", ".mcap", ""])
def test_a_session_is_a_recording(table, tmp_path, suffix):
    out = tmp_path / f"out{suffix}"
    record_session(table, out, np.random.default_rng(0), seconds=0.2)
    found = read_recording(out)
    base_from_world = np.linalg.inv(table.arm.kinematics.world_from_base)
    seen = table.world.look()
    assert found.arm.model == "j2s7s300" and found.arm.prefix == "j2s7s300_"
    assert [found.arm.joints[f"joint_{k}"] for k in range(1, 8)] == pytest.approx(table.arm.configuration())
    assert np.abs(found.base_from_camera - base_from_world @ seen.world_from_camera).max() < 1e-6
    assert np.array_equal(found.frame.color, seen.color)
    world = transform_points(np.linalg.inv(base_from_world) @ found.base_from_camera, found.frame.points)
    error = np.linalg.norm(world - seen.points, axis=-1)
    assert np.nanmedian(error) < 0.0025 and np.nanmax(error) < 0.03
    assert not found.notes


def test_equal_seeds_give_equal_bags(table, tmp_path):
    for name in ("a.bag", "b.bag", "c.bag"):
        record_session(table, tmp_path / name, np.random.default_rng(name == "c.bag"), seconds=0.1)
    a, b, c = ((tmp_path / name).read_bytes() for name in ("a.bag", "b.bag", "c.bag"))
    assert a == b != c


@pytest.mark.parametrize("arm", ARM_MODELS)
def test_any_jaco_can_stand_there(tmp_path, arm):
    with recordable_table(TableToRecord(str(SCENE), arm=arm)) as found:
        record_session(found.table, tmp_path / "out.bag", np.random.default_rng(0), seconds=0.1)
        base_from_tool = np.linalg.inv(found.table.arm.kinematics.world_from_base) @ found.table.arm.world_from_ee()
    assert read_recording(tmp_path / "out.bag").arm.model == arm
    assert np.abs(chain(spoken(tmp_path / "out.bag"), f"{arm}_end_effector") - base_from_tool).max() < 1e-6


def test_the_truth_is_the_table_that_was_recorded(tmp_path):
    with recordable_table(TableToRecord(seed=4)) as found:
        write_scene(found.truth(tmp_path), tmp_path / "truth.yaml")
        poses = found.table.poses()
    standing = load_scene(tmp_path / "truth.yaml")
    assert [entry.name for entry in standing] == list(poses)
    for entry in standing:
        assert np.abs(entry.world_from_object - poses[entry.name]).max() < 1e-5


def test_the_example_is_what_its_readme_says(table, tmp_path):
    assert example_path().stat().st_size < 2_000_000
    record_session(table, tmp_path / "cups.bag", drawing_and_noise(0)[1], seconds=0.5, rate=12)
    made, shipped = read_recording(tmp_path / "cups.bag"), read_recording(example_path())
    assert np.allclose(made.frame.points, shipped.frame.points, atol=0.002, equal_nan=True)
    assert made.arm == shipped.arm
