"""The arm's numbers against the maker's figures, and inverse against forward kinematics."""

import math

import numpy as np
import pybullet
import pytest

from agent.arm.arm_model import ARM_MODELS, DEFAULT_MODEL, arm_model
from agent.arm.grasps import hand_pose
from agent.arm.kinematics import Kinematics
from agent.arm.simulated_arm import SimulatedArm
from agent.errors import BadInput
from structdiffusion.geometry import pose_from_xyz_yaw

JACO = arm_model(DEFAULT_MODEL).hand
HOME = np.array([4.71, 2.84, 0.0, 0.75, 4.62, 4.48, 4.88])  # of the j2s7s300, by its maker
SIX_HOME = np.array([4.8046852, 2.92482, 1.002, 4.2031852, 1.4458, 1.3233])  # of the j2n6s300
ELSEWHERE = pose_from_xyz_yaw(-0.1, 0.05, -0.2, 1.2)


def at_base(name: str) -> Kinematics:
    return Kinematics(arm_model(name), np.eye(4))


@pytest.fixture()
def client():
    client = pybullet.connect(pybullet.DIRECT)
    yield client
    pybullet.disconnect(client)


def test_forward_kinematics_of_the_candle_pose():
    ee = at_base("j2s7s300").forward(np.full(7, math.pi))
    assert ee[:3, 3] == pytest.approx((0.0, -0.013, 1.2603), abs=1e-4)


@pytest.mark.parametrize(
    "name, q, position, approach",
    [
        ("j2s7s300", HOME, (0.2659, -0.2121, 0.5031), (0.97, -0.24, -0.04)),
        ("j2n6s300", SIX_HOME, (0.2127, -0.2566, 0.5070), (0.90, -0.44, -0.04)),
    ],
)
def test_forward_kinematics_of_home(name, q, position, approach):
    ee = at_base(name).forward(q)
    assert ee[:3, 3] == pytest.approx(position, abs=2e-4)
    assert ee[:3, 2] == pytest.approx(approach, abs=0.01)


def test_the_curved_wrist_agrees_with_the_makers_own_parameters():
    """Classic Denavit-Hartenberg parameters of the j2n6s300, from its driver."""
    share = math.sin(math.pi / 6) / math.sin(math.pi / 3)
    upper, forearm, wrist, hand_length = 0.41, 0.2073, 0.0741, 0.16
    d = (0.2755, 0, -0.0098, -(forearm + share * wrist), -2 * share * wrist, -(share * wrist + hand_length))
    a = (0, upper, 0, 0, 0, 0)
    alpha = (math.pi / 2, math.pi, math.pi / 2, math.pi / 3, math.pi / 3, math.pi)
    sign, offset = (-1, 1, 1, 1, 1, 1), (0, -math.pi / 2, math.pi / 2, 0, -math.pi, math.pi / 2)
    arm = at_base("j2n6s300")
    for q in arm.random(np.random.default_rng(0), 50):
        pose = np.eye(4)
        for k in range(6):
            turn = sign[k] * q[k] + offset[k]
            c, s, ca, sa = math.cos(turn), math.sin(turn), math.cos(alpha[k]), math.sin(alpha[k])
            pose = pose @ np.array(
                [[c, -s * ca, s * sa, a[k] * c], [s, c * ca, -c * sa, a[k] * s], [0, sa, ca, d[k]], [0, 0, 0, 1]]
            )
        assert np.linalg.norm(arm.forward(q)[:3, 3] - pose[:3, 3]) < 1e-4
        assert arm.forward(q)[:3, :3] == pytest.approx(pose[:3, :3], abs=1e-3)


def test_the_spherical_arms_are_one_but_for_the_joint_in_the_upper_arm():
    seven, six = at_base("j2s7s300"), at_base("j2s6s300")
    for q in seven.random(np.random.default_rng(0), 20):
        q[2] = 0.0
        assert six.forward(np.delete(q, 2)) == pytest.approx(seven.forward(q), abs=2e-3)


@pytest.mark.parametrize("name", ARM_MODELS)
def test_limits_are_the_makers(name):
    model = arm_model(name)
    degrees = np.degrees(np.stack((model.lower, model.upper), axis=1))[~model.continuous]
    expected = {
        "j2s7s300": [(47, 313), (30, 330), (65, 295)],
        "j2n6s300": [(47, 313), (19, 341)],
        "j2s6s300": [(47, 313), (19, 341), (30, 330)],
    }
    assert degrees == pytest.approx(np.array(expected[name]), abs=0.01)
    assert model.velocity == pytest.approx(np.radians([36.0] * (len(model.joints) - 3) + [48.0] * 3), abs=1e-3)
    assert (model.lower < model.folded).all() and (model.folded < model.upper).all()


def test_an_unknown_model():
    with pytest.raises(BadInput, match="'j2s7s200'; legal: j2s7s300, j2n6s300, j2s6s300"):
        arm_model("j2s7s200")


@pytest.mark.parametrize("name, mass", [("j2s7s300", 5.09), ("j2n6s300", 4.32), ("j2s6s300", 4.39)])
def test_the_body_agrees_with_the_formulas(client, name, mass):
    kinematics = Kinematics(arm_model(name), ELSEWHERE)
    arm = SimulatedArm(client, kinematics)
    for q in kinematics.random(np.random.default_rng(0), 20):
        arm.teleport(q)
        assert arm.world_from_ee() == pytest.approx(kinematics.forward(q), abs=1e-5)
    links = range(pybullet.getNumJoints(arm.body, physicsClientId=client))
    total = sum(pybullet.getDynamicsInfo(arm.body, link, physicsClientId=client)[0] for link in links)
    assert total == pytest.approx(mass, abs=0.01)  # without the base, 0.47 kg, which is bolted down


def test_the_workspace_lies_ahead_of_the_robot():
    assert Kinematics().forward(HOME)[0, 3] > 0.2


@pytest.mark.parametrize("name", ARM_MODELS)
def test_inverse_kinematics_meets_the_target_within_limits(name):
    rng, arm = np.random.default_rng(1), Kinematics(arm_model(name))
    for _ in range(30):
        radius, angle = rng.uniform(0.3, 0.6), rng.uniform(-1.0, 1.0)
        point = np.array([radius * math.cos(angle), radius * math.sin(angle), rng.uniform(0.05, 0.3)])
        target = hand_pose(point, rng.uniform(-math.pi, math.pi))
        q = arm.solve(target, rng)
        assert q is not None
        distance, turn = arm.errors(q[None], target[None])
        assert distance[0] < 0.002 and turn[0] < math.radians(1.0)
        assert (q >= arm.model.lower).all() and (q <= arm.model.upper).all()


def test_inverse_kinematics_of_an_arm_that_stands_elsewhere():
    arm = Kinematics(arm_model("j2n6s300"), ELSEWHERE)
    target = ELSEWHERE @ pose_from_xyz_yaw(0.0, -0.4, 0.3, 0.0) @ hand_pose(np.zeros(3), 0.3)
    assert arm.forward(arm.solve(target, np.random.default_rng(0))) == pytest.approx(target, abs=2e-3)


def test_inverse_kinematics_out_of_reach():
    assert Kinematics().solve(hand_pose(np.array([1.3, 0.0, 0.1]), 0.0), np.random.default_rng(0)) is None


def test_unwind_turns_only_continuous_joints_by_whole_turns():
    arm = Kinematics()
    q = arm.folded + np.array([2 * math.pi, 0, -2 * math.pi, 0, 0, 0, 4 * math.pi])
    assert arm.unwind(q, arm.folded) == pytest.approx(arm.folded)


def test_the_hand_closes_monotonically_near_the_tips():
    gaps = JACO.gaps[:, np.argmin(np.abs(JACO.levels - 0.02))]
    closing = gaps[np.isfinite(gaps)]
    assert (np.diff(closing) < 0).all() and closing[0] > 0.15
    assert np.isnan(JACO.openings_for(np.full((1, len(JACO.levels)), 0.3))).all()
    assert np.isnan(JACO.contacts(np.zeros((1, len(JACO.levels))))[0]).all()


def prisms(top, *widths):
    """Return the widths (B, L) of upright prisms whose tops are at a level."""
    return np.where(top < JACO.levels, np.array(widths)[:, None], 0.0)


def test_wide_things_are_pressed_out_of_the_open_hand():
    """The fingers of the open hand stand apart towards their tips, those of the closed hand lean together."""
    angles, inclines = JACO.contacts(prisms(0.02, 0.14, 0.10, 0.06, 0.03))
    assert (np.diff(angles) > 0).all()
    assert inclines[0] > 0.6 and 0.2 < inclines[1] < 0.6 and inclines[2] < 0.2 and inclines[3] <= 0.0


def test_tips_fold_around_what_comes_deep_enough_into_the_hand():
    _, inclines = JACO.contacts(prisms(-0.012, 0.12, 0.10, 0.08))
    assert inclines == pytest.approx(np.zeros(3))
    narrowing = np.where(JACO.levels > 0.01, 0.0, prisms(-0.012, 0.10))  # where a tip would fold there is nothing
    assert JACO.contacts(narrowing)[1] > 0.2


def test_an_unknown_way_to_hold(client):
    with pytest.raises(ValueError, match="friction, weld"):
        SimulatedArm(client).hold_by("glue")
