"""The inside of a cup belongs to its outside; what stands in it or beside it does not."""

import numpy as np
import pytest

from agent.perception.hollow_objects import hollow_objects_joined


def wall(radius, low, high, side, outward):
    """Half a cylinder wall on the camera's side (-1) or the far side (+1): positions and normals."""
    angle, height = (each.ravel() for each in np.meshgrid(np.linspace(-1.4, 1.4, 30), np.arange(low, high, 0.004)))
    direction = np.column_stack((side * np.cos(angle), np.sin(angle), np.zeros_like(angle)))
    positions = radius * direction + np.column_stack((np.zeros((len(angle), 2)), height))
    return positions, direction if outward else -direction


def joined(*pieces):
    part = np.concatenate([np.full(len(positions), number) for number, (positions, _) in enumerate(pieces)])
    found = hollow_objects_joined(part, *(np.concatenate(each) for each in zip(*pieces, strict=True)))
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


def level_disc(radius, height):
    """A disc that faces up: positions and normals."""
    x, y = (each.ravel() for each in np.meshgrid(*[np.arange(-radius, radius, 0.004)] * 2))
    inside = np.hypot(x, y) < radius
    positions = np.column_stack((x[inside], y[inside], np.full(inside.sum(), height)))
    return positions, np.tile((0.0, 0.0, 1.0), (len(positions), 1))


def test_the_bottom_of_a_cup_is_one_with_its_walls():
    outside, inside = wall(0.04, 0.0, 0.06, -1, True), wall(0.037, 0.02, 0.08, 1, False)
    assert len(set(joined(outside, inside, level_disc(0.03, 0.01)))) == 1


def test_two_pieces_of_one_inside_are_one():
    positions, normals = wall(0.06, 0.0, 0.07, 1, False)
    left = positions[:, 1] > 0
    assert len(set(joined((positions[left], normals[left]), (positions[~left], normals[~left])))) == 1


def test_a_ball_in_a_bowl_is_itself():
    inside = wall(0.1, 0.02, 0.09, 1, False)
    angles = np.meshgrid(np.linspace(0.0, 2 * np.pi, 40), np.linspace(0.0, 1.2, 12))
    turn, tilt = (each.ravel() for each in angles)
    normals = np.column_stack((np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)))
    assert len(set(joined(inside, (0.03 * normals + (0.0, 0.0, 0.05), normals)))) == 2


def test_the_front_of_a_box_behind_another_is_no_inside():
    across, height = (each.ravel() for each in np.meshgrid(np.arange(-0.04, 0.04, 0.004), np.arange(0.0, 0.08, 0.004)))
    front = np.column_stack((np.zeros_like(across), across, height))
    normals = np.tile((-1.0, 0.0, 0.0), (len(front), 1))
    tops = [level_disc(0.03, 0.08)[0] + (x + 0.03, 0.0, 0.0) for x in (0.0, 0.075)]
    ups = np.tile((0.0, 0.0, 1.0), (len(tops[0]), 1))
    near, far = (
        (np.vstack((front + (x, 0.0, 0.0), top)), np.vstack((normals, ups)))
        for x, top in zip((0.0, 0.075), tops, strict=True)
    )
    assert len(set(joined(near, far))) == 2


def level_ring(inner, outer, height, near_half=False):
    """A ring that faces up, or the half of it on the camera's side: positions and normals."""
    positions, normals = level_disc(outer, height)
    away = np.hypot(positions[:, 0], positions[:, 1])
    kept = (away > inner) & ((positions[:, 0] < 0.0) | (not near_half))
    return positions[kept], normals[kept]


@pytest.mark.parametrize("near_half", [False, True])
def test_the_broad_rim_of_a_cup_is_one_with_its_inside(near_half):
    inside = wall(0.037, 0.01, 0.074, 1, False)
    assert len(set(joined(inside, level_ring(0.035, 0.045, 0.073, near_half)))) == 1


def test_a_lid_on_a_cup_is_itself():
    inside = wall(0.037, 0.01, 0.074, 1, False)
    assert len(set(joined(inside, level_disc(0.045, 0.073)))) == 2
