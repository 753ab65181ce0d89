"""What the fingers cannot lift by friction is slid along the table."""

import math

import numpy as np
import pytest

from agent.arm.arm_model import DEFAULT_MODEL, arm_model
from agent.arm.events import Picked, PlanFailed
from agent.arm.grasps import Grasp, grasps_of
from agent.arm.kinematics import Kinematics
from agent.arm.sliding import is_along_table, leads, sliding_path
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from tests.agent.arm.test_executor import build

JACO = arm_model(DEFAULT_MODEL).hand
DOWN = np.diag((1.0, -1.0, -1.0, 1.0))


@pytest.mark.parametrize("kind", ["plate", "book"])
def test_plates_and_books_are_slid(kind):
    events, poses, goals = build([kind], [(0.42, -0.15, 0.6)], [(0.45, 0.1, 0.0, 0.9)], hold="friction")
    picked = next(event for event in events if isinstance(event, Picked))
    assert picked.hold == "the table, friction"
    assert np.linalg.norm(poses[0][:3, 3] - goals[0][:3, 3]) < 0.02 and poses[0][2, 2] > 0.99


def test_what_can_only_be_slid_does_not_get_onto_something():
    poses, goals = [(0.42, -0.15, 0.0), (0.42, 0.2, 0.0)], [(0.42, 0.2, 0.1, 0.0), (0.42, 0.2, 0.0, 0.0)]
    events, *_ = build(["plate", "box"], poses, goals, hold="friction")
    assert [(type(event), event.reason) for event in events] == [(PlanFailed, "it can only be slid along the table")]


def test_the_way_is_straight_and_turns_evenly():
    kinematics, middle = Kinematics(), np.array([0.45, -0.1, 0.0])
    there = pose_from_xyz_yaw(0.45, -0.1, 0.06, 0.0) @ DOWN
    start = kinematics.solve(there, np.random.default_rng(0))
    turn = pose_from_xyz_yaw(0.4, 0.1, 0.0, 0.8) @ pose_from_xyz_yaw(*-middle, 0.0)
    path = sliding_path(kinematics, start, there, turn, middle)
    hands = kinematics.forward(path)
    assert np.abs(hands[:, 2, 3] - 0.06).max() < 0.002  # at one height
    np.testing.assert_allclose(hands[-1, :3, 3], transform_points(turn, there[:3, 3]), atol=0.003)
    assert is_along_table(turn) and not is_along_table(pose_from_xyz_yaw(0.0, 0.0, 0.05, 0.0))
    far = pose_from_xyz_yaw(1.0, 0.0, 0.0, 0.0)
    assert sliding_path(kinematics, start, there, far, middle) is None


@pytest.mark.parametrize(("angle", "ahead"), [(0.0, True), (40.0, True), (60.0, False), (180.0, False)])
def test_the_hand_goes_ahead(angle, ahead):
    """What is pushed from behind turns away."""
    cloud = np.array([[-0.1, -0.1, 0.0], [0.1, 0.1, 0.02]])
    place = 0.1 * np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])
    grasp = Grasp(pose_from_xyz_yaw(*place, 0.05, 0.0) @ DOWN, 0.02, 0.6, 1.0, "rim", 1.0, slides=True)
    assert leads(grasp, cloud, pose_from_xyz_yaw(0.2, 0.0, 0.0, 0.0)) == ahead


def test_grasps_that_lift_come_before_those_that_slide():
    rng = np.random.default_rng(0)
    angles = rng.uniform(0.0, 2 * np.pi, 600)
    can = np.column_stack((0.03 * np.cos(angles) + 0.4, 0.03 * np.sin(angles), rng.uniform(0.0, 0.06, 600)))
    found = [grasp.slides for grasp in grasps_of(can, JACO, friction=True)]
    assert found[0] is False and found == sorted(found) and any(found)
    assert not any(
        grasp.slides for grasp in (*grasps_of(can, JACO), *grasps_of(can + (0, 0, 0.1), JACO, 0.1, friction=True))
    )
