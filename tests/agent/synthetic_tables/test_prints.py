"""Prints: each layer covers the part of an object that it should, and an object of the same product looks the same."""

import numpy as np
import pytest
import trimesh

from agent.synthetic_tables import prints
from agent.synthetic_tables.prints import Print, Surface, draw_print
from agent.synthetic_tables.rendering import (
    camera_pose,
    camera_rays,
    cast,
    colors,
    of_the_same_print,
    printed_part,
    ray_scene,
)
from structdiffusion.geometry import pose_from_xyz_yaw

BOX = (0.2, 0.08, 0.12)


@pytest.fixture
def surface():
    """Points on the four sides and the top of a box that stands on z = 0."""
    mesh = trimesh.creation.box(BOX)
    mesh.apply_translation((0.0, 0.0, BOX[2] / 2))
    points, faces = trimesh.sample.sample_surface(mesh, 4000, seed=0)
    kept = mesh.face_normals[faces][:, 2] > -0.5
    return Surface(points[kept], mesh.face_normals[faces][kept], *mesh.bounds)


def test_a_band_goes_around_and_leaves_the_top(surface):
    for seed in range(5):
        inside = prints._band(np.random.default_rng(seed))(surface)
        heights = surface.points[inside, 2]
        assert not inside[surface.normals[:, 2] > 0.9].any()
        if inside.any():
            outside = surface.points[~inside & (surface.normals[:, 2] < 0.5), 2]
            assert not ((outside > heights.min()) & (outside < heights.max())).any()


def test_a_cap_is_above_and_a_handle_at_one_end_of_the_longer_side(surface):
    cap, end = (draw(np.random.default_rng(3))(surface) for draw in (prints._cap, prints._end))
    assert surface.points[cap, 2].min() > surface.points[~cap, 2].max()
    along, rest = surface.points[end, 0], surface.points[~end, 0]
    assert along.min() >= rest.max() or along.max() <= rest.min()


def test_a_side_is_a_quarter_and_the_top_faces_up(surface):
    side, top = (draw(np.random.default_rng(1))(surface) for draw in (prints._side, prints._top))
    assert len(np.unique(surface.normals[side].round(6), axis=0)) == 1 and abs(surface.normals[side, 2]).max() < 1e-6
    np.testing.assert_array_equal(top, surface.normals[:, 2] > 0.9)


def test_the_inside_of_a_vessel_faces_its_axis():
    angles = np.linspace(0.0, 6.0, 50)
    out = np.column_stack((np.cos(angles), np.sin(angles), 0 * angles))
    points, normals = np.vstack((0.05 * out, 0.047 * out)), np.vstack((out, -out))
    cup = Surface(points, normals, np.array([-0.05, -0.05, 0.0]), np.array([0.05, 0.05, 0.1]))
    np.testing.assert_array_equal(prints._inside(np.random.default_rng(0))(cup), np.arange(100) >= 50)


def test_the_uppermost_layer_counts(surface):
    red, blue = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    layers = ((lambda one: one.points[:, 2] > 0.0, red), (lambda one: one.points[:, 2] > 0.06, blue))
    found = Print(np.zeros(3), layers).colors(surface)
    assert (found[surface.points[:, 2] > 0.06] == blue).all()
    assert (found[(surface.points[:, 2] > 0.0) & (surface.points[:, 2] <= 0.06)] == red).all()


def test_a_seed_gives_one_print_of_legal_colours(surface):
    for seed in range(20):
        found, again = (draw_print(np.random.default_rng(seed)).colors(surface) for _ in range(2))
        np.testing.assert_array_equal(found, again)
        assert found.min() >= 0.0 and found.max() <= 1.0
    assert len({len(np.unique(draw_print(np.random.default_rng(k)).colors(surface), axis=0)) for k in range(20)}) > 2


def test_one_product_looks_alike_wherever_it_stands():
    mesh = trimesh.creation.box(BOX)
    seen = []
    part = printed_part(mesh, np.eye(4), 1, np.random.default_rng(2))
    for pose in (np.eye(4), pose_from_xyz_yaw(0.3, -0.2, 0.0, 1.0)):
        own = of_the_same_print(part, mesh, pose, 1)
        camera = pose @ camera_pose(np.array([-0.6, 0.0, 0.2]), np.array([0.95, 0.0, -np.sqrt(1 - 0.95**2)]), 0.0)
        hits = cast(ray_scene([own]), camera_rays(camera, 200.0, 80, 60))
        lamp = (pose @ np.array([-1.0, 0.3, 1.5, 1.0]))[:3]
        seen.append(colors([own], hits, lamp, np.zeros((60, 80), dtype=bool), np.random.default_rng(0))[hits.there])
    assert seen[0].shape == seen[1].shape and (np.abs(seen[0].astype(int) - seen[1]) < 3).all(axis=1).mean() > 0.97
