"""Arms from files: against the maker's figures, against the physics engine, and the errors."""

import copy
import math
import xml.etree.ElementTree as ElementTree

import numpy as np
import pybullet
import pytest
import trimesh

from agent.arm.arm_file import load_arm
from agent.arm.kinematics import Kinematics
from agent.errors import BadInput
from structdiffusion.geometry import pose_from_xyz_rpy
from tests.agent.arm.gen3 import KNUCKLE, write_arm, write_urdf


@pytest.fixture()
def folder(tmp_path):
    write_urdf(tmp_path)
    return tmp_path


def test_the_stretched_gen3_is_as_high_as_its_maker_says(folder):
    tool = Kinematics(load_arm(write_arm(folder)), np.eye(4)).forward(np.zeros(7))
    assert tool[:3, 3] == pytest.approx((0.0, -0.0246, 1.1873), abs=5e-4)
    assert tool[:3, 2] == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)


@pytest.mark.parametrize("axis", ["0 0 1", "0 0 -1", "1 0 0", "0.6 0 0.8"])
def test_forward_kinematics_agree_with_the_physics_engine(tmp_path, axis):
    """The hand is put midway between the pads, the first of them at +x, whatever else its frame says across z."""
    path = write_arm(tmp_path, hand=[0.0, 0.01, 0.12, 0.0, 0.0, 0.3], pads=["right_pad", "left_pad"])
    urdf = write_urdf(tmp_path, axis)
    arm = Kinematics(load_arm(path), np.eye(4))
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
            expected = tool @ pose_from_xyz_rpy((0.0, 0.0, 0.12), (0.0, 0.0, math.pi / 2))
            assert arm.forward(q) == pytest.approx(expected, abs=1e-5)
    finally:
        pybullet.disconnect(client)


def test_inverse_kinematics_find_reachable_poses(folder):
    arm, rng = Kinematics(load_arm(write_arm(folder)), np.eye(4)), np.random.default_rng(0)
    targets = arm.forward(arm.random(rng, 20))
    found = [arm.solve(target, rng) for target in targets]
    assert all(q is not None for q in found)
    distances, angles = arm.errors(np.stack(found), targets)
    assert distances.max() < 2e-3 and angles.max() < math.radians(1)


def test_limits_are_those_of_the_urdf_and_speed_lowers_them(folder):
    arm = load_arm(write_arm(folder, speed=1.3))
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
        ({"base": "floor"}, "base cannot be 'floor'; legal: tool, link_0"),
        ({"base": "link_7", "tool": "link_1"}, "no joints lead from the base 'link_7'"),
        ({"base": "tool"}, "no joint turns between"),
        ({"home": [0.0] * 6}, "home cannot be .* legal: a list of 7 numbers"),
        ({"home": [0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]}, "home of joint_2 cannot be 3.0; legal: -1.400 to 1.400"),
        ({"home": [math.nan] * 7}, "home cannot be"),
        ({"hand": [0.0, 0.0]}, "hand cannot be .* 6 numbers"),
        ({"fingers": {}}, "fingers cannot be"),
        ({"fingers": {"thumb": [0, 1]}}, f"the joint 'thumb'; legal: {KNUCKLE}"),
        ({"fingers": {KNUCKLE: 1}}, "2 numbers"),
        ({"fingers": {KNUCKLE: [0.3, 0.3]}}, "two different numbers"),
        ({"fingers": {KNUCKLE: [0.8, 0.0]}}, "its pads do not come nearer all the way from open to closed"),
        ({"pads": ["left_pad"]}, "pads cannot be .* legal: two of left_knuckle"),
        ({"pads": ["left_pad", "left_pad"]}, "pads cannot be"),
        ({"pads": ["left_pad", "palm"]}, "pads cannot be"),
        ({"pads": ["left_pad", "left_tip"]}, "both pads move with the joint 'finger_joint'"),
        ({"hand": [0, 0, 0, 0, 1.5708, 0]}, "the hand cannot be planned for: the fingers do not reach beyond the palm"),
        ({"hand": [0, 0, 0, 1.5708, 0, 0]}, "the pads do not stand apart across the approach"),
        ({"speed": -1}, "speed cannot be -1; legal: a number above 0"),
    ],
)
def test_what_is_wrong_is_told_with_the_file_and_what_is_legal(folder, changes, told):
    with pytest.raises(BadInput, match=told) as error:
        load_arm(write_arm(folder, **changes))
    assert "gen3.yaml" in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("text", ["[1, 2", "- a", ""])
def test_a_file_that_is_no_mapping_is_refused(tmp_path, text):
    path = tmp_path / "arm.yaml"
    path.write_text(text)
    with pytest.raises(BadInput, match="arm.yaml"):
        load_arm(path)


@pytest.mark.parametrize(
    "old, new, told",
    [
        ('velocity="1.3963"', "", "the joint 'joint_1' needs a limit"),
        ('type="revolute"', 'type="prismatic"', "the joint 'joint_2' before the tool does not turn on its own"),
        ('type="fixed"', 'type="floating"', "the joint 'end_effector' cannot be 'floating'; legal: fixed, revolute"),
        ('<mimic joint="finger_joint"/>', "", "'right_knuckle_joint' neither is in fingers nor follows one of them"),
        ('<box size="0.022 0.00635 0.0375"/>', "<box/>", "collision of the URDF's link 'left_pad' cannot be used"),
        ('<cylinder radius="0.046"', '<mesh filename="a.stl"', "there is no mesh 'a.stl' beside the URDF"),
        ('<cylinder radius="0.046"', '<cylinder radius="-1"', "'link_0' cannot be used: the sides .* above 0"),
        ('xyz="0 0 -0.061525"', 'xyz="0 0"', "joint 'end_effector' has origin xyz='0 0'; legal: 3 numbers"),
    ],
)
def test_an_urdf_that_cannot_be_planned_for_is_refused(tmp_path, old, new, told):
    path, urdf = write_arm(tmp_path), tmp_path / "gen3.urdf"
    assert old in urdf.read_text()
    urdf.write_text(urdf.read_text().replace(old, new, 1))
    with pytest.raises(BadInput, match=told):
        load_arm(path)


def test_a_hand_without_a_palm_or_pads_without_a_shape_are_refused(tmp_path):
    path, urdf = write_arm(tmp_path), tmp_path / "gen3.urdf"
    whole = ElementTree.fromstring(urdf.read_text())
    for links, told in (
        (("palm", "link_7"), "no link before the fingers"),
        (("left_pad",), "'left_pad', which has no"),
    ):
        root = copy.deepcopy(whole)
        for link in root.findall("link"):
            if link.get("name") in links:
                link.remove(link.find("collision"))
        urdf.write_text(ElementTree.tostring(root, encoding="unicode"))
        with pytest.raises(BadInput, match=told):
            load_arm(path)


@pytest.mark.parametrize("said", ["shapes/base.stl", "package://cell/shapes/base.stl"])
def test_a_mesh_is_replaced_by_its_box(tmp_path, said):
    folder = tmp_path / "cell"
    (folder / "shapes").mkdir(parents=True)
    trimesh.creation.box((20.0, 40.0, 60.0)).apply_translation((0.0, 0.0, 30.0)).export(folder / "shapes" / "base.stl")
    path, urdf = write_arm(folder), folder / "gen3.urdf"
    mesh = f'<mesh filename="{said}" scale="0.001 0.001 0.002"'
    urdf.write_text(urdf.read_text().replace('<cylinder radius="0.046" length="0.154"', mesh, 1))
    base = load_arm(path).solids[0]
    assert not base.round and base.sides == pytest.approx((0.02, 0.04, 0.12))
    assert base.link_from_solid[2, 3] == pytest.approx(0.06 + 0.077)
