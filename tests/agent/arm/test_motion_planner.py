"""Planned paths are free of collisions when checked again, straight lines are straight, and speeds are kept."""

import math

import numpy as np
import pytest

from agent.arm.arm_model import ARM_MODELS, WORLD_FROM_BASE, arm_model
from agent.arm.grasps import hand_pose
from agent.arm.kinematics import Kinematics
from agent.arm.motion_planner import LEAVING, PlanningScene, solid_hull
from agent.arm.self_filter import distance_to_arm
from agent.arm.state import ArmState
from agent.arm.trajectories import LARGEST_JUMP, interpolate, level_path, straight_line, trajectory
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.observation import Table
from structdiffusion.simulation.depth_camera import DepthCamera

ARM = Kinematics()
FOLDED, VELOCITY = ARM.folded, ARM.model.velocity


def box(center, size):
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (0, 2)]) / 2
    return np.asarray(center) + corners * np.asarray(size)


@pytest.fixture()
def planning():
    with PlanningScene(np.random.default_rng(0)) as scene:
        yield scene


@pytest.mark.parametrize("height", [0.0, 0.25, -0.02, -0.1, -0.3])
@pytest.mark.parametrize("name", ARM_MODELS)
def test_folded_poses_are_free_wherever_the_arm_is_mounted(name, height):
    kinematics = Kinematics(arm_model(name), pose_from_xyz_yaw(0.0, 0.0, height, 1.9))
    with PlanningScene(np.random.default_rng(0), kinematics) as scene:
        for angle in (0.0, 0.2, 0.6, 1.1):
            scene.set_fingers([angle] * 3)
            assert not scene.collides(kinematics.folded, 0.01)


@pytest.mark.parametrize("name", ARM_MODELS)
def test_folded_arms_leave_the_cameras_view_of_the_table_free(name):
    camera, table, model = DepthCamera(), Table(), arm_model(name)
    x, y = np.meshgrid(np.linspace(table.x_min, table.x_max, 12), np.linspace(table.y_min, table.y_max, 16))
    ends = np.stack((x, y, np.zeros_like(x)), axis=-1).reshape(-1, 3)
    rays = camera.eye + (ends - camera.eye) * np.linspace(0.0, 1.0, 80)[:, None, None]
    seen = transform_points(np.linalg.inv(WORLD_FROM_BASE), rays.reshape(-1, 3))
    assert distance_to_arm(seen, ArmState(name, dict(zip(model.joints, model.folded)))).min() > 0.005


def test_a_lowered_base_is_no_collision_but_the_table_still_is():
    kinematics = Kinematics(arm_model("j2n6s300"), pose_from_xyz_yaw(0.0, 0.0, -0.3, math.pi / 2))
    rng = np.random.default_rng(0)
    with PlanningScene(rng, kinematics) as scene:
        above = kinematics.solve(hand_pose(np.array([0.45, 0.0, 0.2]), 0.0), rng)
        assert not scene.collides(above)
        assert scene.plan(kinematics.folded, kinematics.unwind(above, kinematics.folded)) is not None
        below = kinematics.solve(hand_pose(np.array([0.45, 0.0, -0.02]), 0.0), rng)
        assert scene.collides(below, 0.0)


def test_an_arm_that_was_put_into_something_is_led_out_of_it(planning):
    start = ARM.solve(hand_pose(np.array([0.45, 0.0, 0.12]), 0.0), np.random.default_rng(0))
    assert planning.overlap(start) == 0.0
    planning.set_obstacle("box", box((0.39, 0.095, 0.0), (0.12, 0.12, 0.12)))
    overlap = planning.overlap(start)
    assert 0.001 < overlap < 0.03
    assert planning.plan(start, FOLDED) is None
    path = planning.plan(start, FOLDED, overlap=overlap + 0.001)
    assert path is not None and not planning.collides(path[-1])
    fine = interpolate(path, 0.02)
    assert not any(planning.collides(q, -overlap - 0.002) for q in fine)
    assert not any(planning.collides(q, 0.0) for q in fine if np.abs(q - start).max() > LEAVING)


def test_a_path_around_a_wall_is_free_when_checked_again(planning):
    rng = np.random.default_rng(0)
    start = ARM.solve(hand_pose(np.array([0.45, -0.25, 0.12]), 0.0), rng)
    goal = ARM.solve(hand_pose(np.array([0.45, 0.25, 0.12]), 0.0), rng, near=start)
    planning.set_obstacle("wall", box((0.45, 0.0, 0.0), (0.5, 0.04, 0.3)))
    assert planning.path_collides(np.stack((start, goal)))
    path = planning.plan(start, goal, checks=150_000)
    assert path is not None
    assert path[0] == pytest.approx(start) and path[-1] == pytest.approx(goal)
    assert not any(planning.collides(q, 0.0) for q in interpolate(path, 0.02))


def test_no_path_into_an_obstacle_or_the_floor(planning):
    inside = ARM.solve(hand_pose(np.array([0.45, 0.0, 0.08]), 0.0), np.random.default_rng(0))
    planning.set_obstacle("box", box((0.45, 0.0, 0.0), (0.2, 0.2, 0.2)))
    assert planning.plan(FOLDED, inside) is None
    planning.remove_obstacle("box")
    assert planning.plan(FOLDED, inside) is not None
    under = ARM.solve(hand_pose(np.array([0.45, 0.0, -0.05]), 0.0), np.random.default_rng(0))
    assert under is None or planning.plan(FOLDED, under) is None


def test_a_held_object_counts(planning):
    q = ARM.solve(hand_pose(np.array([0.45, 0.0, 0.3]), 0.0), np.random.default_rng(0))
    planning.set_obstacle("box", box((0.45, 0.0, 0.0), (0.1, 0.1, 0.12)))
    assert not planning.collides(q)
    planning.hold(box((0.0, 0.0, 0.0), (0.05, 0.05, 0.25)))
    assert planning.collides(q)
    planning.release()
    assert not planning.collides(q)


def test_straight_line_is_straight_and_keeps_the_rotation():
    pose = hand_pose(np.array([0.45, 0.1, 0.08]), 0.4)
    up = hand_pose(np.array([0.45, 0.1, 0.18]), 0.4)
    path = straight_line(ARM, ARM.solve(pose, np.random.default_rng(0)), (pose, up))
    poses = ARM.forward(path)
    assert poses[-1, 2, 3] == pytest.approx(0.18, abs=0.001)
    assert np.abs(poses[:, :2, 3] - pose[:2, 3]).max() < 0.002
    assert np.abs(poses[:, :3, :3] - pose[:3, :3]).max() < 0.01


def test_trajectory_keeps_the_speed_limits():
    path = np.stack((FOLDED, FOLDED + 0.5, FOLDED - 0.3))
    points = trajectory(path, 1 / 240, VELOCITY)
    assert points[0] == pytest.approx(path[0], abs=1e-6) and points[-1] == pytest.approx(path[-1])
    assert (np.abs(np.diff(points, axis=0)) * 240 <= VELOCITY * 1.01).all()


def test_solid_hull_reaches_down_to_the_support():
    points = np.random.default_rng(0).uniform((-0.03, -0.03, 0.09), (0.03, 0.03, 0.1), (300, 3))
    hull = solid_hull(points, 0.02)
    assert hull[:, 2].min() == pytest.approx(0.02) and hull[:, 2].max() > 0.095
    assert len(hull) <= 60
    flat = solid_hull(np.zeros((30, 3)))
    assert len(flat) == 8 and math.isclose(np.ptp(flat[:, 0]), 0.004)


class _NoWay(PlanningScene):
    """A scene in which everything but the two ends of a motion collides: its search only ends at its limit."""

    def collides(self, q, *_, **__):
        super().collides(q)
        return min(np.abs(q - FOLDED).max(), np.abs(q - TURNED).max()) > 0.2


TURNED = FOLDED + np.eye(len(FOLDED))[0] * 1.5


def test_a_search_ends_where_it_is_asked_to():
    seen = []

    def on_check():
        seen.append(1)
        if len(seen) == 400:
            raise KeyboardInterrupt

    with _NoWay(np.random.default_rng(0), on_check=on_check) as scene, pytest.raises(KeyboardInterrupt):
        scene.plan(FOLDED, TURNED, checks=10**7)
    assert len(seen) == 400


def test_what_was_held_is_an_obstacle_to_the_hand_again(planning):
    """The engine gives the number of a removed body to the next one, with the pairs that were let through."""
    column = box((0.5, 0.0, 0.0), (0.06, 0.06, 0.1))
    (q,), (solved,) = planning.kinematics.inverse(hand_pose((0.5, 0.0, 0.06), 0.0)[None], FOLDED[None], 200)
    for _ in range(2):
        planning.set_obstacle("column", column)
        assert solved and planning.collides(q)
        planning.remove_obstacle("column")
        planning.hold(column - (0.5, 0.0, 0.05))
        planning.release()


@pytest.mark.parametrize("rise", [0.0, 0.1])
@pytest.mark.parametrize("turn", [0.0, 1.2, -2.0])
def test_what_is_carried_level_stays_upright(rise, turn):
    start = hand_pose((0.35, 0.2, 0.2), 0.3)
    end = pose_from_xyz_yaw(0.5, -0.25, 0.22, turn) @ pose_from_xyz_yaw(-0.35, -0.2, -0.2, 0.0) @ start
    q = ARM.solve(start, np.random.default_rng(0))
    goal, reached = ARM.inverse(end[None], q[None])
    assert reached[0]
    path = level_path(ARM, q, goal[0], rise)
    assert path is not None
    np.testing.assert_array_equal(path[0], q)
    assert np.abs(ARM.unwind(goal[0], path[-1]) - path[-1]).max() == 0.0
    assert np.abs(np.diff(path, axis=0)).max() <= LARGEST_JUMP
    hands = ARM.forward(path)
    assert hands[:, 2, 2].max() < -math.cos(math.radians(1.0))
    assert hands[:, 2, 3].max() == pytest.approx(0.22 + rise, abs=0.003)


def test_no_level_way_leads_to_another_bend_of_the_arm():
    """It ends in the configuration that is asked for, or there is none."""
    pose, rng = hand_pose((0.45, 0.1, 0.2), 0.3), np.random.default_rng(0)
    first = ARM.solve(pose, rng)
    seeds = first + rng.uniform(-1.5, 1.5, (64, len(first)))
    q, reached = ARM.inverse(np.tile(pose, (64, 1, 1)), np.clip(seeds, ARM.model.lower, ARM.model.upper))
    others = [one for one in q[reached] if np.abs(ARM.unwind(one, first) - first).max() > 1.0]
    assert others
    for other in others:
        assert level_path(ARM, first, other, 0.0) is None
