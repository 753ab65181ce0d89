"""Refinement: what misses a check by little is corrected, what holds stays, nothing is left overlapping."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import estimate, imagined_bodies
from structdiffusion.footprints import clear_gap
from structdiffusion.geometry import pose_from_xyz_yaw, wrap_angle
from structdiffusion.observation import ObjectCloud, Table
from structdiffusion.postprocessing.refinement import align_cutlery, fit_to_size, separate
from structdiffusion.protocol.semantic import check_structure


def block(name: str, width: float = 0.06, height: float = 0.05) -> ObjectCloud:
    """The visible top and sides of a block that stands at the origin."""
    rng = np.random.default_rng(len(name))
    points = rng.uniform(-0.5, 0.5, (800, 3)) * (width, width, height)
    points[:400, 2], points[400:, 0] = height / 2, -width / 2
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * (width, width, height)
    return ObjectCloud(name, "block", (np.concatenate((points, corners)) + (0, 0, height / 2)).astype(np.float32))


def at(places: np.ndarray) -> np.ndarray:
    motions = np.tile(np.eye(4), (len(places), 1, 1))
    motions[:, :2, 3] = places
    return motions


def ring(radii: list[float], centre=(0.45, 0.0)) -> np.ndarray:
    angles = np.arange(len(radii)) * 2 * np.pi / len(radii)
    return centre + np.array(radii)[:, None] * np.column_stack((np.cos(angles), np.sin(angles)))


def failing(objects, motions, spec) -> list[str]:
    return [c.name for c in check_structure(imagined_bodies(objects, motions), spec, Table()) if not c.passed]


@pytest.mark.parametrize("size", ["small", "medium", "large"])
@pytest.mark.parametrize("shape", ["circle", "line"])
def test_every_size_becomes_the_size_asked_for(shape, size):
    objects = [estimate(block(name)) for name in "abcd"]
    for scale in (0.05, 0.085, 0.13):
        places = ring([scale] * 4) if shape == "circle" else np.column_stack(([0.45] * 4, np.arange(4) * scale - 0.2))
        moved = fit_to_size(objects, at(places), StructureSpec(shape, size=size))
        assert not failing(objects, moved, StructureSpec(shape, size=size))
        before, after = places - places.mean(axis=0), moved[:, :2, 3] - moved[:, :2, 3].mean(axis=0)
        # Only the scale changes.
        np.testing.assert_allclose(after / np.linalg.norm(after), before / np.linalg.norm(before), atol=2e-3)


@pytest.mark.parametrize("size", ["medium", "large"])
@pytest.mark.parametrize("shape", ["circle", "line"])
def test_a_size_is_kept_by_objects_a_tenth_broader_than_what_was_seen_of_them(shape, size):
    seen, true = ([estimate(block(name, width)) for name in "abcd"] for width in (0.060, 0.066))
    places = ring([0.05] * 4) if shape == "circle" else np.column_stack(([0.45] * 4, np.arange(4) * 0.07 - 0.1))
    spec = StructureSpec(shape, size=size)
    assert failing(true, at(places), spec) == ["extent / tightest extent"]
    assert not failing(true, fit_to_size(seen, at(places), spec), spec)


def test_what_holds_stays():
    objects = [estimate(block(name)) for name in "abcde"]
    circle = at(ring([0.1, 0.105, 0.1, 0.097, 0.1]))
    np.testing.assert_allclose(fit_to_size(objects, circle, StructureSpec("circle")), circle, atol=1e-6)
    np.testing.assert_allclose(separate(objects, [], circle), circle)
    row = at(np.column_stack(([0.45, 0.452, 0.449, 0.45, 0.45], [-0.2, -0.1, 0.002, 0.1, 0.2])))
    np.testing.assert_allclose(fit_to_size(objects, row, StructureSpec("line")), row, atol=1e-6)
    tower = at(np.full((5, 2), 0.3))
    np.testing.assert_allclose(fit_to_size(objects, tower, StructureSpec("tower")), tower)


def test_what_hardly_misses_is_drawn_in():
    objects = [estimate(block(name)) for name in "abcde"]
    spec, dented = StructureSpec("circle"), at(ring([0.12, 0.19, 0.12, 0.19, 0.12]))
    assert "distance to the circle (m)" in failing(objects, dented, spec)
    assert not failing(objects, fit_to_size(objects, dented, spec), spec)
    row = at(np.column_stack(([0.45, 0.45, 0.48, 0.45, 0.45], [-0.33, -0.11, 0.0, 0.12, 0.24])))
    spec = StructureSpec("line", rotation="north")
    assert set(failing(objects, row, spec)) == {"distance to the line (m)", "gap off the mean gap (m)"}
    assert not failing(objects, fit_to_size(objects, row, spec), spec)


def test_bodies_are_pushed_apart_and_riders_go_along():
    objects = [estimate(block("plate", 0.16, 0.02)), estimate(block("bowl")), estimate(block("mug"))]
    distractor = estimate(block("tin"))
    motions = at(np.array([[0.4, 0.0], [0.4, 0.0], [0.4, 0.1]]))
    motions[1, 2, 3] = 0.02  # the bowl stands on the plate; the mug stands in the plate's rim
    moved = separate(objects, [distractor], motions)
    outlines = [thing.outline_after(motion) for thing, motion in zip(objects, moved)]
    assert clear_gap(outlines[0], outlines[2]) > 0.005
    np.testing.assert_allclose(moved[0, :2, 3], moved[1, :2, 3])
    near = at(np.array([[0.05, 0.0], [0.3, 0.0], [0.05, 0.3]]))
    moved = separate(objects, [distractor], near)
    assert clear_gap(objects[0].outline_after(moved[0]), distractor.outline) > 0.005
    np.testing.assert_allclose(moved[1:], near[1:])


def test_cutlery_points_away_from_the_diner():
    """A fork that lies the wrong way round, one a little off, and a plate, which has no front."""
    rng = np.random.default_rng(0)
    handle = rng.uniform((-0.1, -0.004, 0.0), (0.05, 0.004, 0.004), (300, 3))
    head = rng.uniform((0.05, -0.012, 0.0), (0.1, 0.012, 0.004), (300, 3))
    fork = estimate(ObjectCloud("fork", "fork", np.concatenate((handle, head)).astype(np.float32)))
    objects = [fork, replace(fork, name="fork 2"), replace(estimate(block("plate", 0.2, 0.02)), category="plate")]
    spec = StructureSpec("table setting", rotation="south")  # the diner sits at -x
    motions = at(np.array([[0.4, 0.2], [0.4, -0.2], [0.4, 0.0]]))
    motions[0, :2, :2] *= -1.0  # half a turn
    motions[1, :2, :2] = pose_from_xyz_yaw(0, 0, 0, 0.12)[:2, :2]
    before, after = (imagined_bodies(objects, each) for each in (motions, align_cutlery(objects, motions, spec, 1.0)))
    fronts = [wrap_angle(body.front_yaw) for body in after]
    assert abs(fronts[0]) < math.radians(8.1) and fronts[1] == pytest.approx(wrap_angle(before[1].front_yaw))
    for was, now in zip(before, after):
        np.testing.assert_allclose(now.centroid, was.centroid, atol=1e-9)
    np.testing.assert_array_equal(align_cutlery(objects, motions, StructureSpec("line"), 1.0), motions)
    open_heading = imagined_bodies(objects, align_cutlery(objects, motions, StructureSpec("table setting"), math.pi))
    assert abs(wrap_angle(open_heading[0].front_yaw)) < math.radians(8.1)
