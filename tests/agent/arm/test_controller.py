"""Which body is between the fingers, where several touch them."""

import pytest

from agent.arm.controller import between, both_sides


@pytest.mark.parametrize(
    "touching, body",
    [
        ({5: {0}, 6: {2}}, 5),  # a neighbour has stopped the thumb: nothing is between them
        ({5: {1, 2}, 6: {0, 1}}, 6),
        ({5: {0, 1}, 6: {0, 1, 2}}, 6),
        ({5: set(), 6: set()}, 5),
    ],
)
def test_the_one_that_both_sides_touch_is_between_them(touching, body):
    assert between(touching) == (body, touching[body])


def test_two_fingers_of_one_side_hold_nothing():
    assert both_sides({0, 2}) and not both_sides({1, 2}) and not both_sides({0})
