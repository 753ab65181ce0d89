"""The arm's numbers against the maker's figures, and inverse against forward kinematics."""

import math

import numpy as np
import pybullet
import pytest

from agent.arm import hand
from agent.arm.kinematics import (
    FOLDED,
    LOWER,
    UPPER,
    JacoArm,
    forward_kinematics,
    pose_errors,
    random_configurations,
    solve,
    unwind,
)
from agent.arm.grasps import hand_pose


@pytest.fixture()
def client():
    client = pybullet.connect(pybullet.DIRECT)
    yield client
    pybullet.disconnect(client)


def test_forward_kinematics_of_the_candle_pose():
    ee = forward_kinematics(np.full(7, math.pi), np.eye(4))
    assert ee[:3, 3] == pytest.approx((0.0, -0.013, 1.2603), abs=1e-4)


def test_forward_kinematics_of_home():
    ee = forward_kinematics(np.array([4.71, 2.84, 0.0, 0.75, 4.62, 4.48, 4.88]), np.eye(4))
    assert ee[:3, 3] == pytest.approx((0.2659, -0.2121, 0.5031), abs=2e-4)
    assert ee[:3, 2] == pytest.approx((0.97, -0.24, -0.04), abs=0.01)


def test_the_body_agrees_with_the_formulas(client):
    arm = JacoArm(client)
    for q in random_configurations(np.random.default_rng(0), 20):
        arm.teleport(q)
        assert arm.world_from_ee() == pytest.approx(forward_kinematics(q), abs=1e-5)


def test_the_workspace_lies_ahead_of_the_robot():
    home = forward_kinematics(np.array([4.71, 2.84, 0.0, 0.75, 4.62, 4.48, 4.88]))
    assert home[0, 3] > 0.2


def test_inverse_kinematics_meets_the_target_within_limits():
    rng = np.random.default_rng(1)
    for _ in range(30):
        radius, angle = rng.uniform(0.3, 0.6), rng.uniform(-1.0, 1.0)
        point = np.array([radius * math.cos(angle), radius * math.sin(angle), rng.uniform(0.05, 0.3)])
        target = hand_pose(point, rng.uniform(-math.pi, math.pi))
        q = solve(target, rng)
        assert q is not None
        distance, turn = pose_errors(q[None], target[None])
        assert distance[0] < 0.002 and turn[0] < math.radians(1.0)
        assert (q >= LOWER).all() and (q <= UPPER).all()


def test_inverse_kinematics_out_of_reach():
    assert solve(hand_pose(np.array([1.3, 0.0, 0.1]), 0.0), np.random.default_rng(0)) is None


def test_unwind_turns_only_continuous_joints_by_whole_turns():
    q = FOLDED + np.array([2 * math.pi, 0, -2 * math.pi, 0, 0, 0, 4 * math.pi])
    assert unwind(q, FOLDED) == pytest.approx(FOLDED)


def test_the_hand_closes_monotonically_near_the_tips():
    gaps = hand.gaps()[:, np.argmin(np.abs(hand.LEVELS - 0.02))]
    closing = gaps[np.isfinite(gaps)]
    assert (np.diff(closing) < 0).all() and closing[0] > 0.15
    assert hand.opening_for(np.full(len(hand.LEVELS), 0.3)) is None
    assert hand.contact_angle(np.zeros(len(hand.LEVELS))) is None
