"""Which pixels join two surfaces: slopes along the line of sight, wherever they are in the picture."""

import numpy as np
import pytest

from agent.perception.clustering import bridging

FOCAL, SHAPE = 600.0, (48, 640)
COLUMNS = (np.arange(SHAPE[1]) - SHAPE[1] / 2) / FOCAL
ROWS = (np.arange(SHAPE[0]) - SHAPE[0] / 2) / FOCAL


def points_of(depth):
    """Points (H, W, 3) of a picture all of whose rows have one depth (W,)."""
    depth = np.broadcast_to(depth, SHAPE)
    return np.stack((COLUMNS[None] * depth, ROWS[:, None] * depth, depth), axis=-1)


@pytest.mark.parametrize("column", [60, 320, 580])
def test_a_slope_between_two_surfaces_is_found_at_the_picture_s_side_too(column):
    # Nine pixels from a can at 0.8 m to a floor at 2 m.
    depth = np.interp(np.arange(SHAPE[1]), (column, column + 9), (0.8, 2.0))
    steep = bridging(points_of(depth))[24]
    assert steep[column + 1 : column + 9].all()
    assert not steep[: column - 1].any() and not steep[column + 11 : -2].any()


@pytest.mark.parametrize("turn", [0.0, 0.9, -0.9])
def test_a_face_that_is_seen_at_an_angle_is_a_surface(turn):
    """An upright plane 0.9 m away, turned by nearly 60 degrees."""
    depth = 0.9 / (1.0 + np.tan(turn) * COLUMNS)
    assert not bridging(points_of(depth))[24, 2:-2].any()


@pytest.mark.parametrize("wide", [1, 3])
def test_a_thing_of_a_few_pixels_at_the_picture_s_side_is_no_slope(wide):
    depth = np.full(SHAPE[1], 0.8)
    depth[600 : 600 + wide] = 0.7
    assert not bridging(points_of(depth))[24, 600 : 600 + wide].any()
