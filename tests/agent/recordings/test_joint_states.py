"""The Jaco among whatever a recording tells of joints."""

import math

import numpy as np
import pytest

from agent.recordings.bag_reader import open_bag
from agent.recordings.joint_states import arm_state, joint_streams
from tests.agent.recordings.bag_making import ARM, HOME, Said, joints, nanoseconds, write_bag

FINGERS = tuple(f"j2s7s300_joint_finger_{k}" for k in (1, 2, 3))


def stood(tmp_path, said, moment=0.0, topic=None):
    with open_bag(write_bag(tmp_path / "joints.bag", said)) as bag:
        return arm_state(bag, joint_streams(bag, topic), nanoseconds(moment))


@pytest.mark.parametrize(
    ("prefix", "count", "model"),
    [("j2s7s300_", 7, "j2s7s300"), ("j2n6s300_", 6, "j2n6s300"), ("left_j2s6s300_", 6, "j2s6s300"),
     ("j2s6s200_", 6, "j2s6s300"), ("mico/j2n6s300_", 6, "j2n6s300")],
)  # fmt: skip
def test_the_model_follows_from_its_name(tmp_path, prefix, count, model):
    names = [f"{prefix}joint_{k}" for k in range(1, count + 1)] + [f"{prefix}joint_finger_1"]
    arm, stream, notes = stood(tmp_path, [joints(0, reversed(names), range(count + 1, 0, -1))])
    assert (arm.model, arm.prefix, stream.type, notes) == (model, prefix, "sensor_msgs/msg/JointState", [])
    assert arm.joints == {name.removeprefix(prefix): k for k, name in enumerate(names, start=1)}


@pytest.mark.parametrize(("count", "model"), [(7, "j2s7s300"), (6, "j2n6s300")])
def test_without_a_name_the_number_of_joints_decides(tmp_path, count, model):
    arm, _, notes = stood(tmp_path, [joints(0, [f"joint_{k}" for k in range(1, count + 1)], [0.5] * count)])
    assert arm.model == model and f"with {count} joints it was taken for a {model}" in notes[0]


def test_others_on_the_same_topic_are_passed_over(tmp_path):
    said = [
        joints(0.0, FINGERS, (1, 1, 1), "/joint_states"),
        joints(0.1, ["panda_joint1", "wheel_joint_left"], (2, 2), "/joint_states"),
        joints(0.2, ARM[:5], HOME[:5], "/joint_states"),
        joints(0.3, ARM, [math.nan, *HOME[1:]], "/joint_states"),
        joints(0.4, [*ARM, *FINGERS], [*HOME, 0, 0, 0], "/joint_states"),
        joints(0.5, FINGERS, (1, 1, 1), "/joint_states"),
    ]
    arm, stream, _ = stood(tmp_path, said)
    assert stream.topic == "/joint_states" and arm.joints["joint_finger_2"] == 0 and arm.joints["joint_1"] == HOME[0]


def test_the_driver_goes_before_who_repeats_it_and_a_topic_that_is_named_before_both(tmp_path):
    said = [joints(0, ARM, HOME, "/joint_states"), joints(0, ARM, [1] * 7)]
    assert stood(tmp_path, said)[0].joints["joint_2"] == 1
    (tmp_path / "joints.bag").unlink()
    assert stood(tmp_path, said, topic="/joint_states")[0].joints["joint_2"] == HOME[1]


def test_angles_in_degrees_serve_where_there_is_nothing_else(tmp_path):
    degrees = {f"joint{k}": 10.0 * k for k in range(1, 8)}
    said = [Said("/j2n6s300_driver/out/joint_angles", "kinova_msgs/msg/JointAngles", degrees)]
    arm, _, notes = stood(tmp_path, said)
    assert arm.model == "j2n6s300" and list(arm.joints) == [f"joint_{k}" for k in range(1, 7)]
    np.testing.assert_allclose(list(arm.joints.values()), np.radians(range(10, 70, 10)), rtol=1e-6)
    assert "fingers" in notes[0]


def test_of_two_arms_one_is_taken_and_both_are_reported(tmp_path):
    both = [f"{side}_j2s7s300_joint_{k}" for side in ("left", "right") for k in range(1, 8)]
    arm, _, notes = stood(tmp_path, [joints(0, both, range(14))])
    assert arm.prefix == "left_j2s7s300_" and "2 arms" in notes[0]


def test_joints_from_another_time_are_reported(tmp_path):
    arm, _, notes = stood(tmp_path, [joints(0.0), joints(9.0)], moment=4.0)
    assert arm is not None and "4.0 s from the picture" in notes[0]


def test_without_an_arm_that_is_said(tmp_path):
    arm, stream, notes = stood(tmp_path, [joints(0, FINGERS, (1, 1, 1))])
    assert arm is None and stream is None and notes == ["the recording does not say how the arm stood"]
