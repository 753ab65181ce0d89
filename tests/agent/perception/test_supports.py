"""What stands on what, for boxes of points of which it is known."""

import numpy as np
import pytest

from agent.perception.supports import supports_of


def box(x, y, z, length, width, height):
    """The top and the front of a box, as a camera sees them."""
    along, across, up = (np.arange(-0.5, 0.501, 0.05) for _ in range(3))
    top = np.stack(np.meshgrid(along * length, across * width, [height]), axis=-1).reshape(-1, 3)
    front = np.stack(np.meshgrid([-length / 2], across * width, (up + 0.5) * height), axis=-1).reshape(-1, 3)
    return np.vstack((top, front)) + (x, y, z)


def test_each_object_of_a_stack_stands_on_the_one_below():
    stack = [box(0, 0, 0.11, 0.05, 0.05, 0.04), box(0, 0, 0, 0.12, 0.1, 0.06), box(0, 0, 0.06, 0.08, 0.08, 0.05)]
    supports = supports_of([*stack, box(0.3, 0, 0, 0.05, 0.05, 0.05)])
    assert [one.carrier for one in supports] == [2, None, 1, None]
    assert [one.bottom for one in supports] == pytest.approx([0.11, 0.0, 0.06, 0.0], abs=0.005)


def test_an_object_whose_foot_another_hides_stands_on_the_table():
    behind = box(0.12, 0, 0, 0.06, 0.06, 0.15)
    supports = supports_of([box(0, 0, 0, 0.06, 0.1, 0.08), behind[behind[:, 2] > 0.06]])
    assert [one.carrier for one in supports] == [None, None]


def test_what_hides_all_of_the_surface_below_seems_to_stand_on_what_ends_there():
    lower, upper = box(0, 0, 0, 0.06, 0.1, 0.08), box(0.02, 0, 0.08, 0.1, 0.12, 0.05)
    lower = lower[lower[:, 0] < -0.01]  # the camera sees little more than its front
    on = supports_of([lower, upper])[1]
    assert (on.carrier, on.seen) == (0, False) and on.bottom == pytest.approx(0.08, abs=0.003)
    seen = supports_of([box(0, 0, 0, 0.12, 0.1, 0.06), box(0, 0, 0.06, 0.08, 0.08, 0.05)])[1]
    assert (seen.carrier, seen.seen) == (0, True)
    higher = upper + (0, 0, 0.03)  # it begins higher than the lower one ends
    assert supports_of([lower, higher])[1].carrier is None


def test_what_lies_in_a_bowl_stands_in_it():
    angle, height = np.meshgrid(np.linspace(0, 2 * np.pi, 60), np.linspace(0.004, 0.06, 15))
    radius = 0.05 + 0.5 * height
    bowl = np.stack((radius * np.cos(angle), radius * np.sin(angle), height), axis=-1).reshape(-1, 3)
    floor = np.stack(np.meshgrid(np.linspace(-0.03, 0.03, 9), np.linspace(-0.03, 0.03, 9), [0.004]), axis=-1)
    ball = np.random.default_rng(0).normal(size=(400, 3))
    ball = 0.025 * ball / np.linalg.norm(ball, axis=1, keepdims=True) + (0, 0, 0.045)
    supports = supports_of([np.vstack((bowl, floor.reshape(-1, 3))), ball])
    assert supports[0].carrier is None and supports[1].carrier == 0
    assert 0.0 < supports[1].bottom < 0.03


def test_a_flat_thing_on_a_plate_stands_on_it_and_one_beside_it_on_the_table():
    grid = np.stack(np.meshgrid(np.linspace(-0.1, 0.1, 41), np.linspace(-0.1, 0.1, 41)), axis=-1).reshape(-1, 2)
    radius = np.linalg.norm(grid, axis=1)
    plate = np.column_stack((grid, 0.004 + 0.2 * np.maximum(radius - 0.06, 0)))[radius < 0.1]
    spoon = box(0.01, 0.0, 0.006, 0.1, 0.02, 0.008)
    assert [one.carrier for one in supports_of([plate, spoon])] == [None, 0]
    assert [one.carrier for one in supports_of([plate, spoon + (0.07, 0, 0)])] == [None, None]


def test_nothing_is_carried_where_nothing_is():
    assert supports_of([]) == []
