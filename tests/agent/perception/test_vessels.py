"""The inside of a cup belongs to its outside; what stands in it or beside it does not."""

import numpy as np

from agent.perception.vessels import vessels_closed


def wall(radius, low, high, side, outward):
    """Half a cylinder wall on the camera's side (-1) or the far side (+1): positions and normals."""
    angle, height = (each.ravel() for each in np.meshgrid(np.linspace(-1.4, 1.4, 30), np.arange(low, high, 0.004)))
    direction = np.column_stack((side * np.cos(angle), np.sin(angle), np.zeros_like(angle)))
    positions = radius * direction + np.column_stack((np.zeros((len(angle), 2)), height))
    return positions, direction if outward else -direction


def joined(*pieces):
    part = np.concatenate([np.full(len(positions), number) for number, (positions, _) in enumerate(pieces)])
    found = vessels_closed(part, *(np.concatenate(each) for each in zip(*pieces, strict=True)))
    return [int(np.bincount(found[part == number]).argmax()) for number in range(len(pieces))]


def test_the_far_inner_wall_of_a_cup_is_one_with_its_near_outer_wall():
    outside, inside = wall(0.04, 0.0, 0.06, -1, True), wall(0.037, 0.02, 0.08, 1, False)
    assert len(set(joined(outside, inside))) == 1


def test_a_can_that_stands_in_a_bowl_is_itself():
    inside, can = wall(0.1, 0.02, 0.09, 1, False), wall(0.03, 0.02, 0.1, -1, True)
    assert len(set(joined(inside, can))) == 2


def test_two_cans_side_by_side_are_two():
    one, (positions, normals) = wall(0.035, 0.0, 0.1, -1, True), wall(0.035, 0.0, 0.1, -1, True)
    assert len(set(joined(one, (positions + (0.0, 0.075, 0.0), normals)))) == 2
