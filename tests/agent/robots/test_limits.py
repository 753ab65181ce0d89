"""Motions beyond the ranges, the speeds or the workspace of an arm are refused, by joint and number."""

import numpy as np
import pytest

from agent.arm.kinematics import Kinematics
from agent.errors import RobotRefused
from agent.robots.limits import JointLimits, Workspace
from agent.robots.trajectory import Trajectory
from tests.agent.robots.conftest import MODEL, way

LIMITS = JointLimits.of_arm(MODEL, "left_")


def test_a_motion_within_the_limits_passes():
    LIMITS.check(way(1.0))


@pytest.mark.parametrize(
    ("trajectory", "said"),
    (
        (way(0.4), r"left_joint_1 would turn at 0.750 rad/s; legal: at most 0.628"),
        (
            Trajectory("reach", np.array([0.0, 9.0]), MODEL.folded + np.outer((0, 1), np.eye(7)[5])),
            "left_joint_6 would be",
        ),
        (Trajectory("reach", np.array([0.0]), MODEL.folded[None]), "two points or more"),
        (Trajectory("reach", np.array([0.0, 1.0]), np.zeros((2, 6))), "of 7 joints"),
        (Trajectory("reach", np.array([0.0, 1.0]), np.stack((MODEL.folded, MODEL.folded * np.nan))), "not finite"),
        (Trajectory("reach", np.array([0.0, 0.0]), np.stack((MODEL.folded, MODEL.folded))), "do not increase"),
    ),
)
def test_what_leaves_the_limits_is_refused(trajectory, said):
    with pytest.raises(RobotRefused, match=said):
        LIMITS.check(trajectory)


def test_a_joint_that_turns_without_limit_is_compared_the_shorter_way():
    turned = MODEL.folded + 2 * np.pi * MODEL.continuous
    assert np.abs(LIMITS.difference(turned, MODEL.folded)).max() < 1e-9
    assert np.abs(LIMITS.difference(MODEL.folded + 2 * np.pi, MODEL.folded)).max() > 6.0


def test_a_hand_below_the_table_is_refused():
    kinematics = Kinematics(MODEL)
    workspace = Workspace.above((0.18, 0.72, -0.45, 0.45), kinematics)
    workspace.check(way(1.0))
    below = np.diag((1.0, -1.0, -1.0, 1.0))  # pointing down
    below[:3, 3] = 0.45, 0.0, -0.05
    reached = kinematics.solve(below, np.random.default_rng(0))
    reaches = np.stack((MODEL.folded, reached))
    with pytest.raises(RobotRefused, match=r"the hand would be at \(0.45, -?0.00, -0.05\)"):
        workspace.check(Trajectory("reach", np.array([0.0, 9.0]), reaches))
