"""Planned paths are free of collisions when checked again, straight lines are straight, and speeds are kept."""

import math

import numpy as np
import pytest

from agent.arm.grasps import hand_pose
from agent.arm.kinematics import FOLDED, VELOCITY, forward_kinematics, solve
from agent.arm.motion import PlanningScene, interpolate, solid_hull, straight_line, trajectory


def box(center, size):
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (0, 2)]) / 2
    return np.asarray(center) + corners * np.asarray(size)


@pytest.fixture()
def planning():
    with PlanningScene(np.random.default_rng(0)) as scene:
        yield scene


def test_folded_pose_is_free(planning):
    assert not planning.collides(FOLDED)


def test_a_path_around_a_wall_is_free_when_checked_again(planning):
    rng = np.random.default_rng(0)
    start = solve(hand_pose(np.array([0.45, -0.25, 0.12]), 0.0), rng)
    goal = solve(hand_pose(np.array([0.45, 0.25, 0.12]), 0.0), rng, near=start)
    planning.set_obstacle("wall", box((0.45, 0.0, 0.0), (0.5, 0.04, 0.3)))
    assert planning.path_collides(np.stack((start, goal)))
    path = planning.plan(start, goal, checks=150_000)
    assert path is not None
    assert path[0] == pytest.approx(start) and path[-1] == pytest.approx(goal)
    assert not any(planning.collides(q, 0.0) for q in interpolate(path, 0.02))


def test_no_path_into_an_obstacle_or_the_floor(planning):
    inside = solve(hand_pose(np.array([0.45, 0.0, 0.08]), 0.0), np.random.default_rng(0))
    planning.set_obstacle("box", box((0.45, 0.0, 0.0), (0.2, 0.2, 0.2)))
    assert planning.plan(FOLDED, inside) is None
    planning.remove_obstacle("box")
    assert planning.plan(FOLDED, inside) is not None
    under = solve(hand_pose(np.array([0.45, 0.0, -0.05]), 0.0), np.random.default_rng(0))
    assert under is None or planning.plan(FOLDED, under) is None


def test_a_held_object_counts(planning):
    q = solve(hand_pose(np.array([0.45, 0.0, 0.3]), 0.0), np.random.default_rng(0))
    planning.set_obstacle("box", box((0.45, 0.0, 0.0), (0.1, 0.1, 0.12)))
    assert not planning.collides(q)
    planning.hold(box((0.0, 0.0, 0.0), (0.05, 0.05, 0.25)))
    assert planning.collides(q)
    planning.release()
    assert not planning.collides(q)


def test_straight_line_is_straight_and_keeps_the_rotation():
    pose = hand_pose(np.array([0.45, 0.1, 0.08]), 0.4)
    up = hand_pose(np.array([0.45, 0.1, 0.18]), 0.4)
    path = straight_line(solve(pose, np.random.default_rng(0)), (pose, up))
    poses = forward_kinematics(path)
    assert poses[-1, 2, 3] == pytest.approx(0.18, abs=0.001)
    assert np.abs(poses[:, :2, 3] - pose[:2, 3]).max() < 0.002
    assert np.abs(poses[:, :3, :3] - pose[:3, :3]).max() < 0.01


def test_trajectory_keeps_the_speed_limits():
    path = np.stack((FOLDED, FOLDED + 0.5, FOLDED - 0.3))
    points = trajectory(path, 1 / 240)
    assert points[0] == pytest.approx(path[0], abs=1e-6) and points[-1] == pytest.approx(path[-1])
    assert (np.abs(np.diff(points, axis=0)) * 240 <= VELOCITY * 1.01).all()


def test_solid_hull_reaches_down_to_the_support():
    points = np.random.default_rng(0).uniform((-0.03, -0.03, 0.09), (0.03, 0.03, 0.1), (300, 3))
    hull = solid_hull(points, 0.02)
    assert hull[:, 2].min() == pytest.approx(0.02) and hull[:, 2].max() > 0.095
    assert len(hull) <= 60
    flat = solid_hull(np.zeros((30, 3)))
    assert len(flat) == 8 and math.isclose(np.ptp(flat[:, 0]), 0.004)
