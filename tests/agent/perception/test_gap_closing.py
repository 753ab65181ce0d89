"""A gap that noise put into a surface is closed; a valley between two objects is not, and no step."""

import numpy as np
import pytest

from agent.perception.clustering import normals
from agent.perception.gap_closing import gaps_closed

REACH = 0.01
EYE = np.array([-1.0, 0.0, 0.8])


def patch(corner, along, up):
    """A rectangle of voxels, 4 mm apart, from a corner along two directions (3,), metres."""
    steps = [np.arange(0.0, np.linalg.norm(side), 0.004) / np.linalg.norm(side) for side in (along, up)]
    first, second = (each.reshape(-1, 1) for each in np.meshgrid(*steps))
    return np.array(corner) + first * np.array(along) + second * np.array(up)


def pieces_left(first, second, colors=None):
    positions = np.vstack((first, second)) + np.random.default_rng(0).normal(0.0, 0.0008, (len(first) + len(second), 3))
    pieces = np.repeat([0, 1], [len(first), len(second)])
    lab = None if colors is None else np.array(colors, dtype=float)[pieces]
    return gaps_closed(pieces, positions, normals(positions, EYE), lab, REACH).max() + 1


TOP = patch((0.0, 0.0, 0.1), (0.0, 0.08, 0.0), (0.08, 0.0, 0.0))
BESIDE = patch((0.0, 0.08, 0.1), (0.0, 0.08, 0.0), (0.08, 0.0, 0.0))
WALL_ON_TOP = patch((0.08, 0.0, 0.104), (0.0, 0.08, 0.0), (0.0, 0.0, 0.08))


def test_a_flat_top_in_two_pieces_is_one():
    assert pieces_left(TOP, BESIDE) == 1


@pytest.mark.parametrize("colors", [None, [(50, 0, 0), (50, 0, 0)], [(50, 60, 0), (50, -60, 0)]])
def test_a_side_that_rises_from_a_top_is_another_piece(colors):
    assert pieces_left(TOP, WALL_ON_TOP, colors) == 2


def test_a_surface_that_lies_before_another_is_another_piece():
    positions = np.vstack((TOP, BESIDE + np.array((0.0, 0.0, -0.009))))
    pieces = np.repeat([0, 1], [len(TOP), len(BESIDE)])
    up = np.tile((0.0, 0.0, 1.0), (len(positions), 1))
    assert gaps_closed(pieces, positions, up, None, REACH).max() == 1


def test_a_print_on_a_flat_top_divides_nothing():
    assert pieces_left(TOP, BESIDE, [(50, 60, 0), (50, -60, 0)]) == 1
