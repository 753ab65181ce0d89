"""Traced pictures: everything is where it is, in its colour, lit and with a shadow, and its edges are smooth."""

import numpy as np
import pytest

from agent.rendering.furniture import FLOOR
from agent.rendering.ray_tracing import Stage
from agent.rendering.surfaces import Surface, box, cylinder
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.observation import Table
from structdiffusion.simulation.depth_camera import DepthCamera

LENS = DepthCamera(eye=(-0.3, -0.8, 0.8), target=(0.4, 0.0, 0.0), width=160, height=120)
RED, BLUE = (0.8, 0.1, 0.1), (0.1, 0.2, 0.7)
AWAY = pose_from_xyz_yaw(0.5, 0.3, 0.0, 0.0)


@pytest.fixture(scope="module")
def stage() -> Stage:
    """A red box of 10 cm and a blue can, on the table."""
    vertices, faces = cylinder(0.04, 0.1)
    can = Surface(vertices + (0.0, 0.0, 0.05), faces, BLUE)
    return Stage(LENS, Table(), (0.0, 0.0, 0.0), [Surface(*box((-0.05, -0.05, 0.0), (0.05, 0.05, 0.1)), RED), can])


def at(picture: np.ndarray, *place: float) -> np.ndarray:
    column, row = LENS.pixels(np.array(place)).astype(int)
    return picture[row, column].astype(int)


@pytest.fixture(scope="module")
def picture(stage) -> np.ndarray:
    return stage.picture([pose_from_xyz_yaw(0.35, 0.0, 0.0, 0.4), AWAY])


def test_bodies_are_where_they_are_in_their_colours(picture):
    assert picture.shape == (120, 160, 3) and picture.dtype == np.uint8
    top, can = at(picture, 0.35, 0.0, 0.1), at(picture, 0.5, 0.3, 0.1)
    assert top[0] > 2 * top[1:].max() and can[2] > 2 * can[:2].max()
    wood = at(picture, 0.6, -0.3, 0.0)
    assert wood[0] > wood[1] > wood[2] > 80
    floor = at(picture, -0.5, 0.4, FLOOR)
    assert np.ptp(floor) < 20 and floor.min() > 150  # no void
    pedestal = at(picture, 0.0, -0.11, -0.2)
    assert np.ptp(pedestal) < 25 and pedestal.max() < floor.min()


def test_the_lamp_makes_lit_sides_and_soft_shadows(stage, picture):
    side = at(picture, *(0.35 + 0.05 * np.sin(0.4), -0.05 * np.cos(0.4), 0.05))
    assert at(picture, 0.35, 0.0, 0.1)[0] > side[0] + 15  # the top faces the lamp
    moved = stage.picture([AWAY, AWAY])
    behind = [at(picture, x, 0.06 + 0.5 * (x - 0.42), 0.0) for x in (0.43, 0.45, 0.55)]
    free = [at(moved, x, 0.06 + 0.5 * (x - 0.42), 0.0) for x in (0.43, 0.45, 0.55)]
    taken = [int(a.sum() - b.sum()) for a, b in zip(free, behind, strict=True)]
    assert taken[0] > 60 and taken[2] < 10  # dark beside the box, and nothing far from it
    row = LENS.pixels(np.array((0.45, 0.05, 0.0)))[1].astype(int)
    shades = np.unique((moved[row].astype(int) - picture[row])[:, 0])
    assert len(shades[(shades > 3)]) >= 6  # and not one edge


def test_edges_are_smooth(picture):
    """Around the can, many pixels are partly can and partly wood, in several shades."""
    column, row = LENS.pixels(np.array((0.5, 0.3, 0.05))).astype(int)
    around = picture[row - 14 : row + 15, column - 12 : column + 13].astype(int)
    blueness = around[..., 2] - around[..., 0]
    low, high = np.percentile(blueness, (10, 90))
    share = (blueness - low) / (high - low)
    mixed = share[(share > 0.15) & (share < 0.85)]
    assert high > 40 > 0 > low and len(mixed) > 20 and len(np.unique(mixed.round(1))) >= 5


def test_a_body_at_the_lens_is_no_error(stage):
    assert stage.picture([pose_from_xyz_yaw(-0.3, -0.8, 0.78, 0.0), AWAY]).mean() < 200


def test_normals_are_smooth_around_a_cylinder_and_sharp_at_its_ends():
    surface = Surface(*cylinder(0.1, 0.3), RED)
    corners = surface.vertices[surface.faces]
    side = np.abs(surface.normals[..., 2]) < 0.5
    outward = corners[..., :2] / 0.1
    assert surface.normals[side][:, :2] == pytest.approx(outward[side], abs=0.03)
    assert np.abs(surface.normals[~side][:, 2]).min() == pytest.approx(1.0)
    solid = Surface(*box((-1, -2, -3), (1, 2, 3)), RED)
    assert (solid.vertices[solid.faces].mean(axis=1) * solid.normals[:, 0]).sum(axis=1).min() > 0.9  # outward
