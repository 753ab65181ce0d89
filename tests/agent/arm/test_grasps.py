"""Grasps on clouds of simple shapes whose right grasps are known."""

import math

import numpy as np
import pytest

from agent.arm.arm_model import DEFAULT_MODEL, arm_model
from agent.arm.grasps import grasps_of, hand_pose, is_round
from agent.arm.reachability import Standing

JACO = arm_model(DEFAULT_MODEL).hand


def top_of_box(size, center=(0.45, 0.0), count=800):
    rng = np.random.default_rng(0)
    x, y, z = size
    top = np.column_stack((rng.uniform(-x / 2, x / 2, count), rng.uniform(-y / 2, y / 2, count), np.full(count, z)))
    front = np.column_stack((np.full(count, -x / 2), rng.uniform(-y / 2, y / 2, count), rng.uniform(0, z, count)))
    return np.concatenate((top, front)) + [*center, 0.0]


def ring(radius, height, depth, center=(0.45, 0.0), count=900):
    """A dish seen from above: a rim, and an inner floor `depth` below it."""
    rng = np.random.default_rng(0)
    turn, share = rng.uniform(0, 2 * math.pi, count), np.sqrt(rng.uniform(0, 1, count))
    z = height - depth * np.clip((1 - share) / 0.25, 0, 1)
    return np.column_stack((radius * share * np.cos(turn), radius * share * np.sin(turn), z)) + [*center, 0.0]


def test_hand_pose_is_a_rotation_that_points_down():
    pose = hand_pose(np.zeros(3), 0.7, math.radians(20))
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    assert pose[2, 2] == pytest.approx(-math.cos(math.radians(20)))
    assert pose[:3, 0] == pytest.approx((math.cos(0.7), math.sin(0.7), 0.0))


def test_a_long_box_is_taken_across_its_narrow_side():
    grasps = grasps_of(top_of_box((0.05, 0.2, 0.12)), JACO)
    best = grasps[0]
    assert best.kind == "across"
    assert abs(best.world_from_ee[0, 0]) > 0.95
    assert 0.04 < best.width < 0.07
    assert best.world_from_ee[0, 3] == pytest.approx(0.45, abs=0.01)
    assert best.quality == max(grasp.quality for grasp in grasps)


def test_fingers_stay_above_the_table():
    for size in ((0.05, 0.05, 0.1), (0.02, 0.18, 0.01), (0.06, 0.06, 0.04)):
        for grasp in grasps_of(top_of_box(size), JACO):
            if abs(grasp.world_from_ee[2, 2]) > 0.99:
                assert grasp.world_from_ee[2, 3] > JACO.reach(grasp.opening, grasp.opening)


def test_cutlery_is_straddled():
    grasps = grasps_of(top_of_box((0.02, 0.18, 0.012)), JACO)
    assert grasps and grasps[0].kind == "flat"
    assert abs(grasps[0].world_from_ee[0, 0]) > 0.9


def lifting(points):
    """Return the grasps that hold by friction alone."""
    return [grasp for grasp in grasps_of(points, JACO, friction=True) if not grasp.slides]


def test_by_friction_only_steep_walls_and_narrow_sides_are_lifted():
    """What is not lifted is slid, by the grasps that a weld could hold."""
    plate, bowl = ring(0.12, 0.025, 0.015), ring(0.08, 0.06, 0.045)
    wide, narrow = top_of_box((0.15, 0.15, 0.04)), top_of_box((0.06, 0.13, 0.12))
    for points in (plate, wide):
        assert (
            grasps_of(points, JACO)
            and not lifting(points)
            and len(grasps_of(points, JACO, friction=True)) == len(grasps_of(points, JACO))
        )
    assert lifting(bowl)[0].kind == "rim"
    assert lifting(narrow)


def test_what_would_topple_is_not_slid():
    low, high = ((0.15, 0.15, height) for height in (0.05, 0.15))
    assert any(grasp.slides for grasp in grasps_of(top_of_box(low), JACO, friction=True))
    assert grasps_of(top_of_box(high), JACO) and not any(
        grasp.slides for grasp in grasps_of(top_of_box(high), JACO, friction=True)
    )


def test_what_hangs_down_from_its_rim_is_rather_slid():
    standing = Standing(ring(0.08, 0.06, 0.045), 0.0, JACO, friction=True)
    assert standing.hangs and not standing.slides
    assert not Standing(top_of_box((0.06, 0.13, 0.12)), 0.0, JACO, friction=True).hangs


def test_a_plate_is_taken_by_its_rim():
    grasps = grasps_of(ring(0.12, 0.025, 0.015), JACO)
    assert grasps and {grasp.kind for grasp in grasps} == {"rim"}
    offsets = np.array([grasp.world_from_ee[:2, 3] - (0.45, 0.0) for grasp in grasps])
    assert np.linalg.norm(offsets, axis=1) == pytest.approx(np.full(len(grasps), 0.12), abs=0.015)


def test_nothing_fits_what_is_too_large_or_hardly_seen():
    assert grasps_of(top_of_box((0.25, 0.25, 0.12)), JACO) == []
    assert grasps_of(np.zeros((4, 3)), JACO) == []


def test_round_is_distinguished_from_long():
    assert is_round(ring(0.04, 0.1, 0.05))
    assert not is_round(top_of_box((0.05, 0.1, 0.1)))
