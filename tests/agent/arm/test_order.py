"""The order in which objects can be placed."""

import numpy as np

from agent.arm.order import asides, bottom_at, precedence
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points


def block(x, y, size=0.06, height=0.08):
    rng = np.random.default_rng(0)
    points = rng.uniform((-size / 2, -size / 2, 0), (size / 2, size / 2, height), (400, 3))
    corners = [[sx * size / 2, sy * size / 2, z] for sx in (-1, 1) for sy in (-1, 1) for z in (0, height)]
    return np.concatenate((points, corners)) + [x, y, 0.0]


def test_a_tower_is_built_from_below():
    clouds = [block(0.3, 0.2), block(0.3, -0.2)]
    motions = [pose_from_xyz_yaw(0.2, -0.2, 0.08, 0), pose_from_xyz_yaw(0.2, 0.2, 0.0, 0)]
    under, in_the_way, stands_on = precedence(clouds, motions, [0.0, 0.0])
    assert under == [{1}, set()] and in_the_way == [set(), set()] and stands_on == [1, None]


def test_what_stands_in_the_way_goes_first():
    clouds = [block(0.3, 0.2), block(0.5, 0.0)]
    motions = [pose_from_xyz_yaw(0.2, -0.2, 0.0, 0), pose_from_xyz_yaw(0.0, -0.3, 0.0, 0)]
    under, in_the_way, _ = precedence(clouds, motions, [0.0, 0.0])
    assert under == [set(), set()] and in_the_way == [{1}, set()]


def test_a_swap_needs_a_free_place():
    clouds = [block(0.35, 0.1), block(0.55, 0.1)]
    motions = [pose_from_xyz_yaw(0.2, 0.0, 0.0, 0), pose_from_xyz_yaw(-0.2, 0.0, 0.0, 0)]
    under, in_the_way, _ = precedence(clouds, motions, [0.0, 0.0])
    assert under == [set(), set()] and in_the_way == [{1}, {0}]
    steps = asides([0, 1], under, in_the_way, set(), clouds, [], motions, [0.0, 0.0], np.random.default_rng(0))
    index, motion, aside = steps[0]
    assert aside
    moved = transform_points(motion, clouds[index])[:, :2].mean(axis=0)
    assert np.linalg.norm(moved - (0.35, 0.1)) > 0.08 and np.linalg.norm(moved - (0.55, 0.1)) > 0.08


def test_bottom_after_a_motion():
    cloud = block(0.3, 0.2)
    assert bottom_at(pose_from_xyz_yaw(0.1, 0.0, 0.12, 0.5), cloud, 0.01) == 0.13
