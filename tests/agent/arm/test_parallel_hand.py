"""A hand of two fingers, measured in its URDF, against its maker's figures; and what it takes in physics."""

import math

import numpy as np
import pybullet
import pybullet_data
import pytest

from agent.arm.arm_file import load_arm
from agent.arm.controller import ArmDriver, both_sides
from agent.arm.events import Picked, Placed, Planned
from agent.arm.grasps import grasps_of, hand_pose
from agent.arm.kinematics import Kinematics
from agent.arm.simulated_arm import SimulatedArm
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.simulation.world import TIME_STEP, TabletopWorld
from tests.agent.arm.gen3 import write_arm
from tests.agent.arm.test_executor import build
from tests.agent.arm.test_grasps import ring, top_of_box


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return load_arm(write_arm(tmp_path_factory.mktemp("gen3")))


@pytest.fixture()
def arm(model):
    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setTimeStep(TIME_STEP, physicsClientId=client)
    yield SimulatedArm(client, Kinematics(model, model.mounted))
    pybullet.disconnect(client)


def test_it_opens_and_closes_as_far_as_its_maker_says(model):
    hand = model.hand
    assert hand.fingers == ("finger_joint", "right_knuckle_joint") and len(hand.followers) == 4
    assert hand.widest == pytest.approx(0.085, abs=0.002)
    near_tips = hand.gaps[:, np.argmin(np.abs(hand.levels - 0.14))]
    assert near_tips[0] == pytest.approx(hand.widest) and near_tips[-1] == pytest.approx(0.0, abs=0.003)
    assert (np.diff(near_tips) < 0.0).all()
    assert hand.lowest[0] == pytest.approx(0.149, abs=0.001)  # 0.1303 to the middle of the pads, and half of 37.5 mm


def test_all_joints_of_the_hand_follow_one_drive(arm):
    arm.command_fingers([0.5, 0.5])
    for _ in range(240):
        pybullet.stepSimulation(physicsClientId=arm.client)
    assert arm.finger_angles() == pytest.approx([0.5, 0.5], abs=0.01)
    named = {pybullet.getJointInfo(arm.body, k, arm.client)[1].decode(): k for k in range(30) if k < _count(arm)}
    for name, position in arm.hand.joint_positions([0.5, 0.5]).items():
        assert pybullet.getJointState(arm.body, named[name], arm.client)[0] == pytest.approx(position, abs=0.01)


def _count(arm):
    return pybullet.getNumJoints(arm.body, physicsClientId=arm.client)


def test_the_pads_in_physics_are_where_the_hand_was_measured(arm):
    """On both sides of the end effector, as far apart as its table of gaps says, at every angle."""
    hand, model = arm.hand, arm.model
    for angle in np.linspace(0.0, hand.closed, 4):
        arm.set_fingers([angle, angle])
        positions = dict(zip(model.joints, model.folded, strict=True)) | hand.joint_positions([angle, angle])
        poses = model.link_poses(positions)
        pads = [solid for solid in model.solids if solid.sides == pytest.approx((0.022, 0.00635, 0.0375))]
        at_end = [np.linalg.inv(poses["joint_end_effector"]) @ poses[pad.link] @ pad.link_from_solid for pad in pads]
        x = sorted(pose[0, 3] for pose in at_end)
        level = np.argmin(np.abs(hand.levels - at_end[0][2, 3]))
        table = np.interp(angle, hand.angles, hand.gaps[:, level])
        assert x[1] - x[0] - 0.00635 == pytest.approx(table, abs=0.002)
        assert x[0] == pytest.approx(-x[1], abs=1e-6) and at_end[0][1, 3] == pytest.approx(0.0, abs=1e-6)


def test_what_is_too_wide_between_the_fingers_is_not_grasped(model):
    assert grasps_of(top_of_box((0.078, 0.2, 0.12)), model.hand)
    assert not grasps_of(top_of_box((0.10, 0.2, 0.12)), model.hand)
    kinds = {grasp.kind for grasp in grasps_of(ring(0.055, 0.07, 0.05), model.hand, friction=True)}
    assert kinds == {"rim"}


def test_open_fingers_pass_what_is_wider_just_beside_them(model):
    """A spoon's neck is taken; its bowl begins 1 mm beside the pads."""
    hand, bowl = model.hand, 0.02
    neck, wide = top_of_box((0.01, 0.12, 0.01)), top_of_box((2 * bowl, 0.05, 0.01), (0.45, 0.0))
    wide[:, 1] += hand.lateral + 0.001 + 0.025
    grasps = [each for each in grasps_of(np.concatenate((neck, wide)), hand, friction=True) if not each.slides]
    at_neck = [each for each in grasps if each.kind == "flat" and abs(each.world_from_ee[0, 0]) > 0.999]
    assert at_neck
    for each in at_neck:
        beside = wide[:, 1] - each.world_from_ee[1, 3] < hand.lateral + 0.004
        gap = np.interp(each.opening, hand.angles, hand.gaps[:, np.argmin(np.abs(hand.levels - 0.14))])
        assert not beside.any() or gap > 2 * bowl


@pytest.mark.parametrize("kind", ["fork", "bowl", "box", "candle", "cup", "plate"])
def test_pick_and_place(model, kind):
    events, poses, goals = build(
        [kind], [(0.42, -0.15, 0.6)], [(0.47, 0.1, 0.0, 0.9)], hold="friction",
        kinematics=Kinematics(model, model.mounted),
    )  # fmt: skip
    assert [type(event) for event in events if not type(event).__name__.endswith("Failed")] == [Planned, Picked, Placed]
    assert np.linalg.norm(poses[0][:3, 3] - goals[0][:3, 3]) < 0.03
    assert poses[0][2, 2] > math.cos(math.radians(15))


def test_what_is_stuck_between_the_fingers_is_let_go(model):
    """The fingers stop at a width at which the plan takes them to be open."""
    block = procedural_object("block", 0)
    with TabletopWorld([block], [pose_from_xyz_yaw(0.45, 0.0, 0.0, 0.0)]) as world:
        arm = SimulatedArm(world.client, Kinematics(model, model.mounted))
        around = hand_pose((0.45, 0.0, block.height - 0.03 + model.hand.tip_level), 0.0)
        arm.teleport(arm.kinematics.solve(around, np.random.default_rng(0)))
        driver = ArmDriver(world, arm)
        body, touching = driver.close(*world.bodies)
        assert both_sides(touching)
        driver.take(body)
        driver.let_go(arm.finger_angles().max() + 0.01)
        assert not arm.touching(body)


def test_a_tower_of_two(model):
    height = procedural_object("block", 0).height
    places = [(0.42, -0.2, 0.0), (0.5, 0.2, 0.3)], [(0.45, 0.0, 0.0, 0.0), (0.45, 0.0, height, 0.0)]
    events, poses, goals = build(
        ["block", "can"], *places, hold="friction", kinematics=Kinematics(model, model.mounted)
    )
    assert [event.object for event in events if isinstance(event, Placed)] == [0, 1]
    assert all(np.linalg.norm(pose[:3, 3] - goal[:3, 3]) < 0.02 for pose, goal in zip(poses, goals))


def test_an_arm_may_stand_elsewhere(model):
    """Its base is turned, and the plan with it."""
    turned = Kinematics(model, pose_from_xyz_yaw(0.0, 0.0, 0.0, 0.4))
    events, poses, goals = build(
        ["candle"], [(0.42, -0.15, 0.6)], [(0.47, 0.1, 0.0, 0.9)], hold="friction", kinematics=turned
    )
    assert any(isinstance(event, Placed) for event in events)
    assert np.linalg.norm(poses[0][:3, 3] - goals[0][:3, 3]) < 0.03


def test_fingers_that_slide_and_shapes_that_are_meshes(tmp_path):
    """The Franka Panda as the physics engine brings it along: it opens by 8 cm, says its maker."""
    path = tmp_path / "panda.yaml"
    path.write_text(
        f"urdf: {pybullet_data.getDataPath()}/franka_panda/panda.urdf\n"
        "base: panda_link0\n"
        "tool: panda_hand\n"
        "fingers: {panda_finger_joint1: [0.04, 0.0]}\n"
        "pads: [panda_leftfinger, panda_rightfinger]\n"
        "home: [0.0, -1.7, 0.0, -3.0, 0.0, 1.6, 0.785]\n"
    )
    model = load_arm(path)
    assert model.hand.widest == pytest.approx(0.08, abs=0.001) and model.hand.speed == 0.2
    assert model.hand.joint_positions([0.01, 0.01]) == pytest.approx(dict.fromkeys(model.hand.fingers, 0.03))
    events, poses, goals = build(
        ["candle"], [(0.42, -0.15, 0.6)], [(0.47, 0.1, 0.0, 0.9)], hold="friction",
        kinematics=Kinematics(model, model.mounted),
    )  # fmt: skip
    assert any(isinstance(event, Placed) for event in events)
    assert np.linalg.norm(poses[0][:3, 3] - goals[0][:3, 3]) < 0.03
