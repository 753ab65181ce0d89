import math
from dataclasses import replace

import numpy as np
import pytest

from structdiffusion.completion.estimate import ObjectEstimate
from structdiffusion.geometry import pose_from_xyz_yaw, tilt_between, yaw_of
from structdiffusion.objects.solids import circle_outline
from structdiffusion.postprocessing.settling import settle_each


def thing(x=0.45, y=0.0, radius=0.05, height=0.08, hollow=False) -> ObjectEstimate:
    mean = np.array([x, y, 0.6 * height])
    rim = np.column_stack((circle_outline(radius) + (x, y), np.full(24, height)))
    return ObjectEstimate("can", "can", rim, mean, circle_outline(radius) + (x, y), height, 0.0, True, hollow)


def settle(objects, motions: np.ndarray) -> np.ndarray:
    """Set one proposal (N, 4, 4) down."""
    return settle_each(objects, motions[None])[0]


def motion_to(one: ObjectEstimate, x: float, y: float, lift: float, yaw: float = 0.0) -> np.ndarray:
    """The motion that brings the mean of a thing to (x, y), lifted."""
    motion = pose_from_xyz_yaw(0, 0, 0, yaw)
    motion[:3, 3] = (x, y, one.mean[2] + lift) - motion[:3, :3] @ one.mean
    return motion


def middle(one: ObjectEstimate, motion: np.ndarray) -> np.ndarray:
    return motion[:3, :3] @ one.mean + motion[:3, 3]


@pytest.mark.parametrize("lift", [-0.03, -0.002, 0.0, 0.017])
def test_what_is_about_on_the_table_stands_on_it(lift):
    one = thing()
    settled = settle([one], np.array([motion_to(one, 0.3, 0.2, lift, 1.0)]))[0]
    assert settled[2, 3] == 0.0
    np.testing.assert_allclose(middle(one, settled), (0.3, 0.2, one.mean[2]), atol=1e-12)
    assert yaw_of(settled) == pytest.approx(1.0)


def test_a_thing_in_the_air_above_nothing_comes_down():
    one, other = thing(), thing(y=0.3)
    settled = settle([one, other], np.array([motion_to(one, 0.45, 0.0, 0.2), np.eye(4)]))
    assert settled[0, 2, 3] == 0.0


def test_tilted_goals_become_upright_where_they_were():
    one = thing()
    tilt = math.radians(25)
    motion = pose_from_xyz_yaw(0, 0, 0, 0.5)
    c, s = math.cos(tilt), math.sin(tilt)
    motion[:3, :3] = motion[:3, :3] @ [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    motion[:3, 3] = (0.35, -0.1, one.mean[2]) - motion[:3, :3] @ one.mean
    settled = settle([one], motion[None])[0]
    assert tilt_between(settled, np.eye(4)) == pytest.approx(0.0, abs=1e-7)
    np.testing.assert_allclose(middle(one, settled)[:2], (0.35, -0.1), atol=1e-9)


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
@pytest.mark.parametrize("error", [-0.02, 0.0, 0.02])
def test_towers_stand_just_above_the_flat_top_below_whatever_was_sampled(order, error):
    """A height 2 cm off, too high or too low, and in whatever order the objects are listed."""
    things = [thing(y=y, height=height) for y, height in zip((-0.2, 0.0, 0.2), (0.05, 0.07, 0.06))]
    motions = [motion_to(one, 0.45, 0.0, lift) for one, lift in zip(things, (0.0, 0.05 + error, 0.12 + error))]
    settled = settle([things[i] for i in order], np.array([motions[i] for i in order]))
    lifts = dict(zip(order, settled[:, 2, 3]))
    assert lifts[0] == 0.0
    assert lifts[1] == pytest.approx(0.054)  # 4 mm above, and no more for the next
    assert lifts[2] == pytest.approx(0.124)


def test_only_a_hollow_thing_lets_another_sink():
    """A hollow thing tapers and goes as deep as sampled; it is released a centimetre higher."""
    small = thing(y=0.2, radius=0.03, height=0.06, hollow=True)
    for hollow in (False, True):
        carrier = thing(radius=0.08, height=0.06, hollow=hollow)
        sunk = np.array([np.eye(4), motion_to(small, 0.45, 0.0, 0.025)])
        lift = settle([carrier, small], sunk)[1, 2, 3]
        assert lift == pytest.approx(0.035 if hollow else 0.064)
        # A lift near the rim means the rim.
        rim = np.array([np.eye(4), motion_to(small, 0.45, 0.0, 0.05)])
        assert settle([carrier, small], rim)[1, 2, 3] == pytest.approx(0.064)


def test_neighbours_that_touch_are_not_stacked():
    one, other = thing(), thing(y=0.3)
    touching = np.array([np.eye(4), motion_to(other, 0.45, 0.097, 0.03)])  # outlines overlap by 3 mm
    assert settle([one, other], touching)[1, 2, 3] == 0.0


def test_the_input_stays_as_it_was():
    one = thing()
    motions = np.array([motion_to(one, 0.3, 0.2, 0.01, 1.0)])
    copy = motions.copy()
    settle([one], motions)
    np.testing.assert_array_equal(motions, copy)


def test_what_is_set_inside_stands_on_the_floor_that_the_camera_saw():
    bowl, block = thing(radius=0.08, height=0.06, hollow=True), thing(y=0.3, radius=0.03, height=0.05)
    floor = np.array([[0.45 + x, y, 0.01] for x in (-0.02, 0.0, 0.02) for y in (-0.02, 0.0, 0.02)])
    bowl = replace(bowl, points=np.concatenate((bowl.points, floor)))
    inside = np.array([np.eye(4), motion_to(block, 0.45, 0.0, 0.003)])
    assert settle([bowl, block], inside)[1, 2, 3] == pytest.approx(0.02)  # the floor, and 1 cm above it
    beside = np.array([np.eye(4), motion_to(block, 0.45, 0.1, 0.003)])  # 1 cm over the rim: a neighbour too near
    assert settle([bowl, block], beside)[1, 2, 3] == 0.0


def test_a_thing_wider_than_the_opening_stays_on_the_rim():
    bowl, lid = thing(radius=0.05, height=0.06, hollow=True), thing(y=0.3, radius=0.06, height=0.02)
    motions = np.array([np.eye(4), motion_to(lid, 0.45, 0.0, 0.03)])
    assert settle([bowl, lid], motions)[1, 2, 3] == pytest.approx(0.064)


def test_many_proposals_are_set_down_as_each_alone():
    """A tower, the same upside down, and side by side: each as if it were the only one."""
    broad, narrow = thing(radius=0.06, height=0.05), thing(radius=0.03, height=0.07)
    proposals = np.array(
        [
            [motion_to(broad, 0.4, 0.1, 0.0, 0.3), motion_to(narrow, 0.41, 0.1, 0.06)],
            [motion_to(broad, 0.4, 0.1, 0.08), motion_to(narrow, 0.41, 0.1, 0.0, -2.0)],
            [motion_to(broad, 0.4, 0.1, 0.03), motion_to(narrow, 0.4, 0.3, -0.01)],
        ]
    )
    settled = settle_each([broad, narrow], proposals)
    np.testing.assert_array_equal(settled, [settle([broad, narrow], each) for each in proposals])
    np.testing.assert_allclose(settled[:, :, 2, 3], [[0.0, 0.054], [0.074, 0.0], [0.0, 0.0]], atol=1e-9)
