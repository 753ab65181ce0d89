"""Arms from files: against the maker's figures, against the physics engine, and the errors."""

import math

import numpy as np
import pybullet
import pytest
import yaml

from agent.arm.arm_file import load_arm
from agent.arm.kinematics import Kinematics
from agent.errors import BadInput
from structdiffusion.geometry import pose_from_xyz_rpy
from tests.agent.arm.gen3 import ARM, KNUCKLE, write_urdf


def saved(folder, **changes):
    """Write the Gen3 with changed keys; one that is `None` is left out."""
    path = folder / "gen3.yaml"
    path.write_text(yaml.safe_dump({key: value for key, value in (ARM | changes).items() if value is not None}))
    return path


@pytest.fixture()
def folder(tmp_path):
    write_urdf(tmp_path)
    return tmp_path


def test_the_stretched_gen3_is_as_high_as_its_maker_says(folder):
    tool = Kinematics(load_arm(saved(folder)), np.eye(4)).forward(np.zeros(7))
    assert tool[:3, 3] == pytest.approx((0.0, -0.0246, 1.1873), abs=5e-4)
    assert tool[:3, 2] == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)


@pytest.mark.parametrize("axis", ["0 0 1", "0 0 -1", "1 0 0", "0.6 0 0.8"])
def test_forward_kinematics_agree_with_the_physics_engine(tmp_path, axis):
    urdf, hand = write_urdf(tmp_path, axis), [0.0, 0.01, 0.12, 0.0, 0.0, math.pi / 2]
    arm = Kinematics(load_arm(saved(tmp_path, hand=hand)), np.eye(4))
    client = pybullet.connect(pybullet.DIRECT)
    try:
        body = pybullet.loadURDF(str(urdf), useFixedBase=True, physicsClientId=client)
        for q in arm.random(np.random.default_rng(0), 5):
            for joint, angle in enumerate(q):
                pybullet.resetJointState(body, joint, angle, physicsClientId=client)
            state = pybullet.getLinkState(body, 7, computeForwardKinematics=True, physicsClientId=client)
            tool = np.eye(4)
            tool[:3, 3] = state[4]
            tool[:3, :3] = np.reshape(pybullet.getMatrixFromQuaternion(state[5]), (3, 3))
            expected = tool @ pose_from_xyz_rpy(hand[:3], hand[3:])
            assert arm.forward(q) == pytest.approx(expected, abs=1e-5)
    finally:
        pybullet.disconnect(client)


def test_inverse_kinematics_find_reachable_poses(folder):
    arm, rng = Kinematics(load_arm(saved(folder)), np.eye(4)), np.random.default_rng(0)
    targets = arm.forward(arm.random(rng, 20))
    found = [arm.solve(target, rng) for target in targets]
    assert all(q is not None for q in found)
    distances, angles = arm.errors(np.stack(found), targets)
    assert distances.max() < 2e-3 and angles.max() < math.radians(1)


def test_limits_are_those_of_the_urdf_and_speed_lowers_them(folder):
    arm = load_arm(saved(folder, speed=1.3))
    assert arm.name == "gen3" and arm.fingers == {KNUCKLE: (0.0, 0.8)}
    assert arm.continuous.tolist() == [True, False] * 3 + [True]
    assert arm.upper[1::2] == pytest.approx((1.4, 2.66, 2.23))
    assert arm.velocity == pytest.approx([1.3] * 4 + [1.2218] * 3)


@pytest.mark.parametrize(
    "changes, told",
    [
        ({"home": None}, "lacks the key 'home'; needed: urdf, base"),
        ({"gripper": 1}, "unknown key 'gripper'; legal: urdf, base"),
        ({"urdf": "none.urdf"}, "none.urdf"),
        ({"base": "floor"}, "base cannot be 'floor'; legal: link_0"),
        ({"base": "link_7", "tool": "link_1"}, "no joints lead from the base 'link_7'"),
        ({"base": "tool"}, "no joint turns between"),
        ({"home": [0.0] * 6}, "home cannot be .* legal: a list of 7 numbers"),
        ({"home": [0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]}, "home of joint_2 cannot be 3.0; legal: -1.400 to 1.400"),
        ({"home": [math.nan] * 7}, "home cannot be"),
        ({"hand": [0.0, 0.0]}, "hand cannot be .* 6 numbers"),
        ({"fingers": {}}, "fingers cannot be"),
        ({"fingers": {"thumb": [0, 1]}}, f"the joint 'thumb'; legal: {KNUCKLE}"),
        ({"fingers": {KNUCKLE: 1}}, "2 numbers"),
        ({"speed": -1}, "speed cannot be -1; legal: a number above 0"),
    ],
)
def test_what_is_wrong_is_told_with_the_file_and_what_is_legal(folder, changes, told):
    with pytest.raises(BadInput, match=told) as error:
        load_arm(saved(folder, **changes))
    assert "gen3.yaml" in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("text", ["[1, 2", "- a", ""])
def test_a_file_that_is_no_mapping_is_refused(tmp_path, text):
    path = tmp_path / "arm.yaml"
    path.write_text(text)
    with pytest.raises(BadInput, match="arm.yaml"):
        load_arm(path)


@pytest.mark.parametrize("old, new", [('velocity="1.3963"', ""), ('type="revolute"', 'type="prismatic"')])
def test_an_urdf_that_cannot_be_planned_for_is_refused(folder, old, new):
    urdf = folder / "gen3.urdf"
    urdf.write_text(urdf.read_text().replace(old, new, 1))
    with pytest.raises(BadInput, match="needs a limit|does not turn on its own"):
        load_arm(saved(folder))
