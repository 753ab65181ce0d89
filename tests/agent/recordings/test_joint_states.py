"""The Jaco among whatever a recording tells of joints."""

import math
import re

import numpy as np
import pytest

from agent.recordings.bag_reader import open_bag
from agent.recordings.joint_states import arm_state, joint_streams
from tests.agent.recordings.bag_making import ARM, HOME, Said, joints, nanoseconds, write_bag

FINGERS = tuple(f"j2s7s300_joint_finger_{k}" for k in (1, 2, 3))


def stood(tmp_path, said, moment=0.0, topic=None):
    with open_bag(write_bag(tmp_path / "joints.bag", said)) as bag:
        return arm_state(bag, joint_streams(bag, topic), nanoseconds(moment))


def arm_names(prefix, count, fingers=3, tips=0):
    return [
        *(f"{prefix}joint_{k}" for k in range(1, count + 1)),
        *(f"{prefix}joint_finger_{k}" for k in range(1, fingers + 1)),
        *(f"{prefix}joint_finger_tip_{k}" for k in range(1, tips + 1)),
    ]


@pytest.mark.parametrize("fingers", [0, 3])
@pytest.mark.parametrize(
    ("prefix", "count", "model"),
    [("j2s7s300_", 7, "j2s7s300"), ("j2n6s300_", 6, "j2n6s300"), ("left_j2s6s300_", 6, "j2s6s300"),
     ("mico/j2n6s300_", 6, "j2n6s300"), ("/robot1/j2n6s300/", 6, "j2n6s300")],
)  # fmt: skip
def test_the_model_follows_from_its_name_whatever_the_order_and_what_else_turns(
    tmp_path, prefix, count, model, fingers
):
    names = arm_names(prefix, count, fingers, fingers)
    angles = {name: k for k, name in enumerate(names, start=1)}
    turning = {"wheel_left_joint": 7.0, "wheel_joint_1": 1.0, "pan_joint": 0.1, "torso_lift_joint": 0.2}
    found = stood(tmp_path, [joints(0, reversed([*angles, *turning]), reversed([*angles.values(), *turning.values()]))])
    arm = found.state
    assert (arm.model, arm.prefix, found.notes, found.other) == (model, prefix, (), "")
    assert found.stream.type == "sensor_msgs/msg/JointState"
    assert arm.joints == {name.removeprefix(prefix): k for k, name in enumerate(names, start=1)}


@pytest.mark.parametrize(("count", "model"), [(7, "j2s7s300"), (6, "j2n6s300")])
def test_without_a_name_the_joints_and_three_fingers_decide(tmp_path, count, model):
    names = arm_names("", count)
    found = stood(tmp_path, [joints(0, names, [0.5] * len(names), "/joint_states")])
    said = f"with {count} joints and 3 fingers it was taken for a {model}"
    assert found.state.model == model and said in found.notes[0]


@pytest.mark.parametrize("topic", ["/j2n6s300_driver/out/joint_state", "/arm/j2n6s300/joint_states"])
def test_the_topic_may_name_the_model(tmp_path, topic):
    found = stood(tmp_path, [joints(0, arm_names("", 6, 0), [0.5] * 6, topic)])
    assert (found.state.model, found.notes) == ("j2n6s300", ())


UR5 = [f"{part}_joint" for part in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")]


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (arm_names("m1n6s200_", 6, 2), "6 joints and 2 fingers.*a m1n6s200 by its name"),
        (arm_names("j2n6s200_", 6, 2), "6 joints and 2 fingers.*a j2n6s200 by its name"),
        (arm_names("j2n6s200_", 6, 0), "6 joints and no fingers.*a j2n6s200 by its name"),
        (arm_names("j2n4s300_", 4, 3), "4 joints and 3 fingers"),
        (arm_names("j1n6s300_", 6, 3), "a j1n6s300 by its name"),
        (arm_names("j2n6s300_", 7, 3), "7 joints and 3 fingers"),
        (arm_names("j2s7s300_", 6, 3), "6 joints and 3 fingers"),
        (arm_names("j2n6s300_", 6, 2), "6 joints and 2 fingers"),
        (arm_names("", 6, 2), "6 joints and 2 fingers"),
        (arm_names("", 6, 0), "6 joints and no fingers"),
        (arm_names("abb_", 6, 0), "abb_joint_1"),
        (
            [f"panda_joint{k}" for k in range(1, 8)] + ["panda_finger_joint1", "panda_finger_joint2"],
            "7 joints, with panda_finger_joint1, panda_finger_joint2, ",
        ),
        ([*arm_names("", 7, 0), "finger_joint"], "7 joints, with finger_joint, "),
        ([f"iiwa_joint_{k}" for k in range(1, 8)], "7 joints and no fingers"),
        ([f"joint_a{k}" for k in range(1, 7)], "joint_a1"),
        (UR5, "shoulder_pan_joint"),
        ([f"left_{name}" for name in UR5], "left_shoulder_pan_joint"),
    ],
)
def test_another_arm_is_named_and_not_taken(tmp_path, names, said):
    found = stood(tmp_path, [joints(0, names, [0.5] * len(names), "/joint_states")])
    assert found.state is None and found.notes == (found.other,)
    assert re.search(said, found.other) and "expected: joint_1 to joint_6" in found.other
    assert "no trajectory is exported" in found.other and "no name" not in found.other


def test_a_joint_that_is_stated_twice_in_different_places_tells_nothing(tmp_path):
    for last, known in ((2.0, False), (HOME[-1], True)):
        said = [joints(0, [*ARM, ARM[-1], *FINGERS], [*HOME, last, 0, 0, 0])]
        (tmp_path / str(known)).mkdir()
        assert (stood(tmp_path / str(known), said).state is not None) == known


def test_others_on_the_same_topic_are_passed_over(tmp_path):
    said = [
        joints(0.0, FINGERS, (1, 1, 1), "/joint_states"),
        joints(0.1, ["panda_joint1", "wheel_joint_left"], (2, 2), "/joint_states"),
        joints(0.2, ARM[:5], HOME[:5], "/joint_states"),
        joints(0.3, ARM, [math.nan, *HOME[1:]], "/joint_states"),
        joints(0.4, [*ARM, *FINGERS], [*HOME, 0, 0, 0], "/joint_states"),
        joints(0.5, FINGERS, (1, 1, 1), "/joint_states"),
    ]
    found = stood(tmp_path, said)
    arm = found.state
    assert (
        found.stream.topic == "/joint_states" and arm.joints["joint_finger_2"] == 0 and arm.joints["joint_1"] == HOME[0]
    )


def test_the_driver_goes_before_who_repeats_it_and_a_topic_that_is_named_before_both(tmp_path):
    said = [joints(0, ARM, HOME, "/joint_states"), joints(0, ARM, [1] * 7)]
    assert stood(tmp_path, said).state.joints["joint_2"] == 1
    (tmp_path / "joints.bag").unlink()
    assert stood(tmp_path, said, topic="/joint_states").state.joints["joint_2"] == HOME[1]


def test_angles_in_degrees_serve_where_there_is_nothing_else(tmp_path):
    degrees = {f"joint{k}": 10.0 * k for k in range(1, 8)}
    said = [Said("/j2n6s300_driver/out/joint_angles", "kinova_msgs/msg/JointAngles", degrees)]
    found = stood(tmp_path, said)
    arm, notes = found.state, found.notes
    assert arm.model == "j2n6s300" and list(arm.joints) == [f"joint_{k}" for k in range(1, 7)]
    np.testing.assert_allclose(list(arm.joints.values()), np.radians(range(10, 70, 10)), rtol=1e-6)
    assert "fingers" in notes[0]


@pytest.mark.parametrize("other", [arm_names("right_j2s7s300_", 7, 3), UR5, [f"panda_joint{k}" for k in range(1, 8)]])
@pytest.mark.parametrize("apart", [False, True])
def test_of_two_arms_none_is_taken_unless_a_topic_is_named(tmp_path, other, apart):
    one = arm_names("left_j2s7s300_", 7, 3)
    if apart:
        said = [joints(0, one, [0.5] * 10, "/left/states"), joints(0, other, [0.5] * len(other), "/right/states")]
    else:
        said = [joints(0, [*one, *other], [0.5] * (10 + len(other)), "/joint_states")]
    found = stood(tmp_path, said)
    assert found.state is None and "2 arms" in found.other and other[0] in found.other and one[0] in found.other
    assert ("--topic joints=TOPIC" in found.other) == apart
    if apart:
        (tmp_path / "joints.bag").unlink()
        assert stood(tmp_path, said, topic="/left/states").state.prefix == "left_j2s7s300_"


def test_joints_from_another_time_are_reported(tmp_path):
    found = stood(tmp_path, [joints(0.0), joints(9.0)], moment=4.0)
    assert found.state is not None and "4.0 s from the picture" in found.notes[0]


def test_without_an_arm_that_is_said(tmp_path):
    found = stood(tmp_path, [joints(0, FINGERS, (1, 1, 1))])
    assert (found.state, found.stream, found.other) == (None, None, "")
    assert found.notes == ("the recording does not say how the arm stood",)
