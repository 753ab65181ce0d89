"""Joint angles for taking and releasing: what is found is right, and is found once."""

import itertools
import math

import numpy as np
import pytest

from agent.arm.kinematics import Kinematics
from agent.arm.motion_planner import PlanningScene
from agent.arm.reachability import APPROACH, SPINS, Reachability, Standing
from agent.arm.trajectories import straight_lines
from structdiffusion.geometry import pose_from_xyz_yaw, raised

ARM = Kinematics()
JACO = ARM.model.hand
AWAY = pose_from_xyz_yaw(0.05, 0.2, 0.0, 0.0)


def cylinder(radius=0.03, height=0.1, center=(0.42, -0.1)):
    rng = np.random.default_rng(0)
    turn, share = rng.uniform(0, 2 * math.pi, 600), np.sqrt(rng.uniform(0, 1, 600))
    top = np.column_stack((radius * share * np.cos(turn), radius * share * np.sin(turn), np.full(600, height)))
    side = np.column_stack((radius * np.cos(turn), radius * np.sin(turn), rng.uniform(0, height, 600)))
    return np.concatenate((top, side)) + [*center, 0.0]


@pytest.fixture()
def reachability():
    with PlanningScene(np.random.default_rng(0)) as scene:
        yield Reachability(scene, np.random.default_rng(1))


def test_pairs_reach_the_grasp_and_the_release(reachability):
    standing = Standing(cylinder(), 0.0, JACO)
    pairs = list(itertools.islice(reachability.pairs(standing, AWAY, 0.03), 40))
    assert len(pairs) == 40 and standing.spun
    poses = np.stack([pair.pick.grasp.world_from_ee for pair in pairs])
    goals = np.stack([raised(pair.goal_motion @ pose, 0.03) for pair, pose in zip(pairs, poses)])
    for q, targets in (([pair.pick.q for pair in pairs], poses), ([pair.q for pair in pairs], goals)):
        distance, angle = ARM.errors(np.stack(q), targets)
        assert distance.max() < 0.002 and angle.max() < math.radians(1)
    turns = {round(math.atan2(pair.goal_motion[1, 0], pair.goal_motion[0, 0]), 3) for pair in pairs}
    assert 1 < len(turns) <= SPINS  # of a round object the turn is free, and its middle is where it was asked for
    middle = np.append(cylinder().min(axis=0) + cylinder().max(axis=0), 2.0) / 2
    assert np.abs([pair.goal_motion @ middle - AWAY @ middle for pair in pairs]).max() < 1e-9


def test_what_was_found_for_one_goal_is_used_for_the_next(reachability):
    standing = Standing(cylinder(), 0.0, JACO)
    first = next(reachability.pairs(standing, AWAY, 0.03))
    picks = standing.picks[0]
    again = next(reachability.pairs(standing, AWAY.copy(), 0.03))
    other = next(reachability.pairs(standing, np.eye(4), 0.03))
    assert again is first and standing.picks[0] is picks and other.pick in picks
    assert reachability.at_pick(standing, first.pick) is reachability.at_pick(standing, first.pick)


def test_a_goal_out_of_reach_has_no_pairs(reachability):
    far = pose_from_xyz_yaw(1.2, 0.0, 0.0, 0.0)
    assert next(reachability.pairs(Standing(cylinder(), 0.0, JACO), far, 0.03), None) is None


def test_lines_go_straight_and_end_where_the_arm_ends(reachability):
    standing = Standing(cylinder(), 0.0, JACO)
    pick = next(reachability.pairs(standing, AWAY, 0.03)).pick
    pose = pick.grasp.world_from_ee
    reach = reachability.at_pick(standing, pick)
    for line, direction in ((reach.back, -pose[:3, 2]), (reach.up, np.array([0.0, 0.0, 1.0]))):
        hands = ARM.forward(line)
        offsets = hands[:, :3, 3] - pose[:3, 3]
        along = offsets @ direction
        assert along[-1] == pytest.approx(APPROACH, abs=0.003)
        assert np.abs(offsets - along[:, None] * direction).max() < 0.003
        assert np.abs(hands[:, :3, :3] - pose[:3, :3]).max() < 0.02
        assert np.abs(np.diff(line, axis=0)).max() < 0.35
    (far,) = straight_lines(ARM, pick.q[None], pose[None], np.array([[1.0, 0.0, 0.0]]), 1.0)
    reached = ARM.forward(far)[:, 0, 3] - pose[0, 3]
    assert 0.1 < reached[-1] < 0.8 and np.abs(np.diff(far, axis=0)).max() < 0.35
