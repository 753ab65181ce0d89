"""Objects divided at their colours: two things in two colours are two, and one thing in two colours is one."""

import numpy as np
import pytest

from agent.perception.clustering import normals
from agent.perception.color import lab
from agent.perception.color_regions import divided_by_regions

EYE = np.array([-0.7, 0.0, 0.6])
STEP = 0.004
REACH = 0.009
RED, GREEN, BLUE, YELLOW, WHITE = (190, 40, 40), (50, 150, 70), (45, 70, 180), (220, 190, 40), (225, 225, 225)


def grid(*axes):
    return np.column_stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")])


def box(x, y, z, length, width, height, color, yaw=0.0):
    """The five upper faces of a box that stands on height z: positions (V, 3), outward normals (V, 3), colour."""
    a, b = (np.arange(-side / 2, side / 2 + STEP / 2, STEP) for side in (length, width))
    c = np.arange(STEP / 2, height, STEP)
    faces = [(np.column_stack((grid(a, b), np.full(len(a) * len(b), height))), (0, 0, 1))]
    for sign in (-1, 1):
        along, across = grid(a, c), grid(b, c)
        side = np.full(len(along), sign * width / 2)
        faces.append((np.column_stack((along[:, 0], side, along[:, 1])), (0, sign, 0)))
        side = np.full(len(across), sign * length / 2)
        faces.append((np.column_stack((side, across[:, 0], across[:, 1])), (sign, 0, 0)))
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    places = np.vstack([face for face, _ in faces]) @ turn.T + (x, y, z)
    ways = np.vstack([np.tile(way, (len(face), 1)) for face, way in faces]) @ turn.T
    return places, ways, np.tile(color, (len(places), 1))


def wall_of_can(x, y, z, radius, height, color, way=1):
    """The wall of an upright cylinder from outside (way 1) or from inside (-1)."""
    around = grid(np.arange(0, 2 * np.pi, STEP / radius), np.arange(STEP / 2, height, STEP))
    out = np.column_stack((np.cos(around[:, 0]), np.sin(around[:, 0]), np.zeros(len(around))))
    places = out * radius + np.outer(around[:, 1], (0, 0, 1)) + (x, y, z)
    return places, way * out, np.tile(color, (len(places), 1))


def disc(x, y, z, radius, color):
    across = np.arange(-radius, radius + STEP / 2, STEP)
    flat = grid(across, across)
    flat = flat[np.linalg.norm(flat, axis=1) < radius]
    places = np.column_stack((flat, np.zeros(len(flat)))) + (x, y, z)
    return places, np.tile((0.0, 0.0, 1.0), (len(places), 1)), np.tile(color, (len(places), 1))


def can(x, y, z, radius, height, color):
    wall, top = wall_of_can(x, y, z, radius, height, color), disc(x, y, z + height, radius, color)
    return tuple(np.vstack(pair) for pair in zip(wall, top, strict=True))


def seen(*parts):
    """Return what the camera sees of some surfaces: positions, colours (V, 3) uint8 in light and shade,
    and part (V,).
    """
    places, ways, colors = (np.vstack(each) for each in zip(*parts, strict=True))
    number = np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts])
    sight = places - EYE
    away = np.linalg.norm(sight, axis=1)
    facing = (ways * sight).sum(axis=1) < 0
    cell = np.floor(sight / away[:, None] / (0.8 * STEP)).astype(int)
    _, place = np.unique(cell, axis=0, return_inverse=True)
    nearest = np.full(place.max() + 1, np.inf)
    np.minimum.at(nearest, place.ravel(), away)
    visible = facing & (away < nearest[place.ravel()] + 0.012)
    rng = np.random.default_rng(0)
    light = 0.65 + 0.35 * np.clip(ways @ (-0.5, 0.3, 0.81), 0, 1)
    shaded = np.clip(colors * light[:, None] + rng.normal(0, 2, colors.shape), 0, 255).astype(np.uint8)
    places = places + rng.normal(0, 0.0006, places.shape)
    return places[visible], shaded[visible], number[visible]


def divided(*parts):
    """Return the part and the found object (V,) of each voxel of some surfaces that were taken for one object."""
    places, colors, number = seen(*parts)
    fringe = np.zeros(len(places), dtype=bool)
    whole = np.zeros(len(places), dtype=int)
    shades = lab(colors)
    return number, divided_by_regions(whole, places, normals(places, EYE), shades, fringe, EYE, REACH)


TWO_THINGS = {
    "a fork on a plate": [can(0, 0, 0, 0.1, 0.015, GREEN), box(0, 0, 0.015, 0.02, 0.17, 0.008, RED)],
    "a cup on a plate": [can(0, 0, 0, 0.1, 0.015, GREEN), can(0.02, 0, 0.015, 0.035, 0.08, BLUE)],
    "a can on a book": [box(0, 0, 0, 0.15, 0.2, 0.03, WHITE), can(0.02, 0.03, 0.03, 0.03, 0.1, RED)],
    "a die on a die": [box(0, 0, 0, 0.04, 0.04, 0.04, YELLOW), box(0, 0.004, 0.04, 0.04, 0.04, 0.04, BLUE, 0.4)],
    "a box beside a box": [box(0, -0.04, 0, 0.08, 0.08, 0.1, RED), box(0, 0.04, 0, 0.08, 0.08, 0.1, BLUE)],
    "a can beside a can": [can(0, -0.034, 0, 0.034, 0.1, WHITE), can(0, 0.036, 0, 0.034, 0.1, RED)],
    "a can before a box": [can(-0.06, 0, 0, 0.03, 0.06, YELLOW), box(0.05, 0, 0, 0.06, 0.12, 0.12, BLUE)],
    "a pen across a jug": [can(0, 0, 0, 0.05, 0.12, GREEN), box(0, 0, 0.122, 0.012, 0.18, 0.012, RED)],
}


@pytest.mark.parametrize("parts", TWO_THINGS.values(), ids=TWO_THINGS)
def test_two_things_in_two_colours_are_two(parts):
    part, found = divided(*parts)
    assert len(np.unique(found)) == 2
    first, second = (np.bincount(found[part == k]).argmax() for k in (0, 1))
    assert first != second
    assert (found[part == 0] == first).mean() > 0.9 and (found[part == 1] == second).mean() > 0.9


def cup(x, outside, inside):
    return [
        wall_of_can(x, 0, 0, 0.04, 0.09, outside), wall_of_can(x, 0, 0.004, 0.036, 0.086, inside, way=-1),
        disc(x, 0, 0.004, 0.036, inside),
    ]  # fmt: skip


ONE_THING = {
    "a cup with a coloured inside": cup(0, WHITE, BLUE),
    "a bottle with a cap": [
        wall_of_can(0, 0, 0, 0.035, 0.12, GREEN),
        *(disc(0, 0, 0.12 + 2 * k * 0.004, 0.035 - k * 0.004, GREEN) for k in range(6)),
        can(0, 0, 0.16, 0.015, 0.03, RED),
    ],
    "a jar with a lid": [can(0, 0, 0, 0.04, 0.08, WHITE), can(0, 0, 0.08, 0.04, 0.012, RED)],
    "a knife with a handle": [box(0, -0.05, 0, 0.02, 0.1, 0.012, RED), box(0, 0.05, 0, 0.02, 0.1, 0.008, WHITE)],
    "a pan with a handle": [can(0, 0, 0, 0.09, 0.04, BLUE), box(0, 0.16, 0.025, 0.02, 0.14, 0.012, YELLOW)],
    "a cup with a handle": [can(0, 0, 0, 0.04, 0.09, WHITE), box(0, 0.055, 0.02, 0.012, 0.03, 0.05, RED)],
    "a box with a label on its top": [
        box(0, 0, 0, 0.12, 0.16, 0.06, WHITE), box(0, 0, 0.06, 0.06, 0.08, 0.0005, BLUE),
    ],
    "a can with a label around it": [
        can(0, 0, 0, 0.035, 0.03, WHITE), can(0, 0, 0.03, 0.035, 0.05, RED), can(0, 0, 0.08, 0.035, 0.02, WHITE),
    ],
    "a box with a stripe around it": [
        box(0, 0, 0, 0.1, 0.1, 0.04, BLUE), box(0, 0, 0.04, 0.1, 0.1, 0.02, YELLOW),
        box(0, 0, 0.06, 0.1, 0.1, 0.04, BLUE),
    ],
}  # fmt: skip


@pytest.mark.parametrize("parts", ONE_THING.values(), ids=ONE_THING)
def test_one_thing_in_two_colours_is_one(parts):
    _, found = divided(*parts)
    assert len(np.unique(found)) == 1


def ball(radius, marked):
    """A ball with a mark of another colour where it is highest, or on its side."""
    angle = grid(np.arange(0, 2 * np.pi, 0.7 * STEP / radius), np.arange(0.03, np.pi - 0.5, STEP / radius))
    out = np.column_stack((
        np.sin(angle[:, 1]) * np.cos(angle[:, 0]), np.sin(angle[:, 1]) * np.sin(angle[:, 0]), np.cos(angle[:, 1]),
    ))  # fmt: skip
    mark = out @ (np.array(marked) / np.linalg.norm(marked)) > np.cos(0.6)
    return out * radius + (0, 0, radius), out, np.where(mark[:, None], RED, WHITE)


@pytest.mark.parametrize("where", [(0, 0, 1), (-1, 0, 0.7), (-0.6, 0.4, 0.6)])
def test_a_ball_with_a_mark_is_one(where):
    _, found = divided(ball(0.05, where))
    assert len(np.unique(found)) == 1


def test_what_lies_across_a_plate_does_not_divide_the_plate():
    part, found = divided(can(0, 0, 0, 0.1, 0.015, GREEN), box(0, 0, 0.015, 0.02, 0.24, 0.01, RED))
    plate = found[part == 0]
    assert (plate == np.bincount(plate).argmax()).mean() > 0.95


def test_many_colours_are_a_print():
    x, y = np.meshgrid(np.arange(-0.048, 0.05, 0.024), np.arange(-0.048, 0.05, 0.024))
    colors = (RED, GREEN, BLUE, YELLOW, WHITE)
    tiles = [
        box(a, b, 0, 0.024, 0.024, 0.08 + 0.006 * (k % 2), colors[k % 5])
        for k, (a, b) in enumerate(zip(x.ravel(), y.ravel(), strict=True))
    ]
    _, found = divided(*tiles)
    assert len(np.unique(found)) == 1


def test_a_piece_goes_to_the_neighbour_in_its_colour():
    """A can stands partly behind another, and geometry gave the upper half of it to that one."""
    places, colors, number = seen(can(0.06, -0.04, 0, 0.036, 0.08, BLUE), can(0, 0.0, 0, 0.036, 0.08, GREEN))
    wrongly = np.where((number == 0) & (places[:, 2] < 0.05), 0, 1)
    fringe = np.zeros(len(places), dtype=bool)
    found = divided_by_regions(wrongly, places, normals(places, EYE), lab(colors), fringe, EYE, REACH)
    assert len(np.unique(found)) == 2
    assert len(np.unique(found[number == 0])) == 1


def test_two_objects_of_one_colour_stay_two():
    places, colors, number = seen(can(0, -0.04, 0, 0.036, 0.08, BLUE), can(0, 0.036, 0, 0.036, 0.08, BLUE))
    fringe = np.zeros(len(places), dtype=bool)
    found = divided_by_regions(number, places, normals(places, EYE), lab(colors), fringe, EYE, REACH)
    np.testing.assert_array_equal(found, number)
