"""Moves in an order that can be carried out."""

import numpy as np
import pytest

from agent.environment.move_order import ordered_moves
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.observation import Table


def box(x: float, y: float) -> np.ndarray:
    corners = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (0, 1)], dtype=float)
    return corners * (0.03, 0.03, 0.06) + (x, y, 0.0)


def by(x: float, y: float, z: float = 0.0) -> np.ndarray:
    return pose_from_xyz_yaw(x, y, z, 0.0)


def carried_out(clouds, moves):
    """Every place on the way, checked to be free in the plane at the same height."""
    now = [cloud.copy() for cloud in clouds]
    for index, motion in moves:
        now[index] = transform_points(motion, now[index])
        low, high = now[index].min(axis=0), now[index].max(axis=0)
        for other, cloud in enumerate(now):
            if other != index:
                assert (low > cloud.max(axis=0) - 1e-9).any() or (high < cloud.min(axis=0) + 1e-9).any()
    return now


def test_supports_come_first():
    clouds = [box(0.3, 0.2), box(0.3, -0.2)]
    moves = ordered_moves(clouds, np.array([by(0.2, -0.2, 0.06), by(0.2, 0.2)]), [], Table())
    assert [index for index, _ in moves] == [1, 0]
    carried_out(clouds, moves)


def test_what_stands_in_a_goal_goes_first():
    clouds = [box(0.3, 0.0), box(0.4, 0.0), box(0.5, 0.0)]
    motions = np.array([by(0.1, 0.0), by(0.1, 0.0), by(0.1, 0.0)])
    moves = ordered_moves(clouds, motions, [], Table())
    assert [index for index, _ in moves] == [2, 1, 0]
    carried_out(clouds, moves)


def test_a_swap_sets_one_aside():
    clouds, other = [box(0.3, 0.0), box(0.5, 0.0)], box(0.3, 0.1)
    motions = np.array([by(0.2, 0.0), by(-0.2, 0.0)])
    moves = ordered_moves(clouds, motions, [other], Table())
    assert len(moves) == 3
    ends = carried_out([*clouds, other], moves)
    for end, cloud, motion in zip(ends, clouds, motions, strict=False):
        assert end == pytest.approx(transform_points(motion, cloud))


def test_without_room_the_rest_comes_all_the_same():
    clouds, table = [box(0.3, 0.0), box(0.37, 0.0)], Table(0.26, 0.41, -0.05, 0.05)
    moves = ordered_moves(clouds, np.array([by(0.07, 0.0), by(-0.07, 0.0)]), [], table)
    assert sorted(index for index, _ in moves) == [0, 1]
