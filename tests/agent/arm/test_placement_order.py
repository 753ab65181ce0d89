"""The order in which objects can be placed."""

import numpy as np
import pytest
from shapely import MultiPoint

from agent.arm.placement_order import asides, bottom_at, precedence, stands_above
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.observation import Table


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


@pytest.mark.parametrize("table", [Table(), Table(0.1, 0.6, -0.1, 0.45), Table(0.45, 0.55, 0.2, 0.28)])
def test_a_swap_needs_a_free_place_on_the_table(table):
    clouds = [block(0.35, 0.1), block(0.55, 0.1)]
    motions = [pose_from_xyz_yaw(0.2, 0.0, 0.0, 0), pose_from_xyz_yaw(-0.2, 0.0, 0.0, 0)]
    under, in_the_way, _ = precedence(clouds, motions, [0.0, 0.0])
    assert under == [set(), set()] and in_the_way == [{1}, {0}]
    steps = asides([0, 1], under, in_the_way, set(), clouds, [], motions, [0.0, 0.0], table, np.random.default_rng(0))
    index, motion, aside = steps[0]
    assert aside
    moved = transform_points(motion, clouds[index])[:, :2].mean(axis=0)
    assert table.overhang(moved[None]) == 0.0
    assert np.linalg.norm(moved - (0.35, 0.1)) > 0.08 and np.linalg.norm(moved - (0.55, 0.1)) > 0.08


def test_bottom_after_a_motion():
    cloud = block(0.3, 0.2)
    assert bottom_at(pose_from_xyz_yaw(0.1, 0.0, 0.12, 0.5), cloud, 0.01) == 0.13


def tower(count, x=0.4, y=0.0, height=0.08):
    """The clouds of a tower from below, and what each block stands on."""
    bottoms = [k * height for k in range(count)]
    return [block(x, y) + (0.0, 0.0, bottom) for bottom in bottoms], bottoms


def test_what_stands_on_another_is_higher_and_over_it():
    clouds, bottoms = tower(3)
    clouds, bottoms = [*clouds, block(0.4, 0.2) + (0.0, 0.0, 0.08)], [*bottoms, 0.08]
    outlines = [MultiPoint(cloud[:, :2]).convex_hull for cloud in clouds]
    found = {(j, i) for j in range(4) for i in range(4) if stands_above(j, i, outlines, bottoms)}
    assert found == {(1, 0), (2, 0), (2, 1)}  # the fourth is as high as the second, but stands elsewhere
    assert not stands_above(1, 0, outlines, [0.0, 0.002, 0.0, 0.0])  # two millimetres are the sensor's noise


def test_a_tower_is_taken_down_from_the_top():
    clouds, bottoms = tower(3)
    motions = [pose_from_xyz_yaw(0.0, 0.2 * (k - 1), -bottoms[k], 0.0) for k in range(3)]
    under, in_the_way, stands_on = precedence(clouds, motions, bottoms)
    assert under == [set(), set(), set()] and stands_on == [None, None, None]
    assert in_the_way[0] == {1, 2} and in_the_way[2] == set()
    assert 2 in in_the_way[1]


def test_only_what_carries_nothing_is_moved_aside_down_to_the_table():
    clouds, bottoms = tower(2)
    clouds, bottoms = [*clouds, block(0.6, 0.25)], [*bottoms, 0.0]
    motions = [np.eye(4), np.eye(4), pose_from_xyz_yaw(-0.2, -0.25, 0.0, 0.0)]
    motions[0][0, 3], motions[1][0, 3] = 0.15, 0.15
    under, in_the_way, _ = precedence(clouds, motions, bottoms)
    assert in_the_way[2] == {0, 1}
    waiting, rng = [0, 1, 2], np.random.default_rng(0)
    steps = asides(waiting, under, in_the_way, set(), clouds, [], motions, bottoms, Table(), rng)
    assert [index for index, _, _ in steps] == [1]
    assert transform_points(steps[0][1], clouds[1])[:, 2].min() == 0.0


def test_a_tower_built_upside_down_begins_with_the_top_moved_aside():
    clouds, bottoms = tower(3)
    motions = [pose_from_xyz_yaw(0.0, 0.0, bottoms[2 - k] - bottoms[k], 0.0) for k in range(3)]
    under, in_the_way, stands_on = precedence(clouds, motions, bottoms)
    assert under == [{1, 2}, {2}, set()] and stands_on == [1, 2, None]
    assert in_the_way[2] == {0, 1} and in_the_way[0] >= {1, 2}
    steps = asides([0, 1, 2], under, in_the_way, set(), clouds, [], motions, bottoms, Table(), np.random.default_rng(0))
    assert [index for index, _, _ in steps] == [2]  # all that can be moved: it carries nothing
