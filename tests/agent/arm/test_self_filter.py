"""Distances to the arm agree with the physics engine's, and with those to every solid one by one."""

import numpy as np
import pybullet
import pytest

from agent.arm.arm_model import ARM_MODELS, arm_model
from agent.arm.jaco_hand import FINGER_OPEN, FINGERS
from agent.arm.self_filter import distance_to_arm
from agent.arm.state import ArmState
from agent.errors import BadInput
from tests.counting import counted_calls

RADIUS = 0.002  # m, of the probe


def state(name: str, seed: int = 0) -> ArmState:
    """An arm somewhere within its limits, wound up, its fingers half closed."""
    model, rng = arm_model(name), np.random.default_rng(seed)
    angles = dict(zip(model.joints, rng.uniform(model.lower, model.upper)))
    return ArmState(name, {**angles, **dict.fromkeys(FINGERS, 0.7)}, f"{name}_")


def around(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform((-0.8, -0.8, -0.2), (0.8, 0.8, 1.2), (count, 3))


@pytest.mark.parametrize("name", ARM_MODELS)
def test_distances_agree_with_the_physics_engine(name, tmp_path):
    arm, points = state(name), around(60)
    here = {"physicsClientId": pybullet.connect(pybullet.DIRECT)}
    try:
        file = tmp_path / "arm.urdf"
        file.write_text(arm_model(name).urdf)
        body = pybullet.loadURDF(str(file), useFixedBase=True, **here)
        for joint in range(pybullet.getNumJoints(body, **here)):
            joint_name = pybullet.getJointInfo(body, joint, **here)[1].decode()
            if joint_name in arm.joints:
                pybullet.resetJointState(body, joint, arm.joints[joint_name], **here)
        probe = pybullet.createMultiBody(
            0.0, pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=RADIUS, **here), **here
        )
        distances = distance_to_arm(points, arm)
        for point, distance in zip(points, distances, strict=True):
            pybullet.resetBasePositionAndOrientation(probe, point.tolist(), (0, 0, 0, 1), **here)
            closest = min(found[8] for found in pybullet.getClosestPoints(probe, body, 3.0, **here))
            assert distance == pytest.approx(max(closest + RADIUS, 0.0), abs=1e-3)
    finally:
        pybullet.disconnect(**here)


@pytest.mark.parametrize("name", ARM_MODELS)
def test_what_is_left_out_to_save_time_changes_nothing(name):
    arm, model = state(name, 1), arm_model(name)
    points = np.concatenate((around(2000, 1), np.zeros((1, 3))))
    poses = model.link_poses(arm.joints)
    each = []
    for solid in model.solids:
        inside = np.linalg.inv(poses[solid.link] @ solid.link_from_solid) @ np.column_stack((points, np.ones(2001))).T
        if solid.round:
            beyond = np.array([np.hypot(*inside[:2]) - solid.sides[0] / 2, abs(inside[2]) - solid.sides[2] / 2])
        else:
            beyond = abs(inside[:3]) - solid.sides[:, None] / 2
        each.append(np.linalg.norm(np.maximum(beyond, 0.0), axis=0))
    distances = distance_to_arm(points.astype(np.float32), arm)
    np.testing.assert_allclose(distances, np.min(each, axis=0), atol=1e-6)
    assert distances[-1] == 0.0 and (distances > 0.01).mean() > 0.5


def test_the_points_of_a_picture_are_taken_all_at_once():
    arm, points = state("j2s7s300"), around(300_000).astype(np.float32)
    points[::7] = np.nan
    with counted_calls() as steps:
        distances = distance_to_arm(points, arm)
    assert steps.count < 150_000  # for 300,000 points
    np.testing.assert_array_equal(np.isnan(distances), np.isnan(points[:, 0]))


def test_no_points_have_no_distances():
    assert distance_to_arm(np.empty((0, 3)), state("j2n6s300")).shape == (0,)


def test_missing_fingers_are_open():
    recorded, points = state("j2n6s300"), around(500)
    arm_alone = ArmState(recorded.model, {name: recorded.joints[name] for name in arm_model(recorded.model).joints})
    opened = ArmState(recorded.model, {**recorded.joints, **dict.fromkeys(FINGERS, FINGER_OPEN)})
    np.testing.assert_array_equal(distance_to_arm(points, arm_alone), distance_to_arm(points, opened))
    assert (distance_to_arm(points, recorded) != distance_to_arm(points, opened)).any()


@pytest.mark.parametrize("spoilt", [None, np.nan])
def test_an_arm_that_is_not_fully_known(spoilt):
    angles = dict(state("j2s6s300").joints)
    angles.pop("joint_3")
    if spoilt is not None:
        angles["joint_3"] = spoilt
    with pytest.raises(BadInput, match="how joint_3 of its j2s6s300 stood.*needed: joint_1, joint_2.*joint_6"):
        distance_to_arm(around(3), ArmState("j2s6s300", angles))
    with pytest.raises(BadInput, match="no arm model 'ur5'; legal: j2s7s300, j2n6s300, j2s6s300"):
        distance_to_arm(around(3), ArmState("ur5", angles))
