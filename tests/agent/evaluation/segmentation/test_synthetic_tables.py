"""Synthetic tables: what is drawn stands where it should, and what is rendered has its truth beside it."""

import numpy as np
import pytest
from scipy import ndimage

from agent.evaluation.segmentation.synthetic_tables import synthetic_table
from agent.synthetic_tables.arrangements import ARRANGEMENTS, Arrangement, NoRoom
from agent.synthetic_tables.sensors import SENSORS, facing, measured, shadowed
from agent.synthetic_tables.shapes import PARTS, placed_footprint

HALF = np.array([0.45, 0.6])


def arranged(kind, part, seed):
    for draw in range(50):
        half = np.array([0.45, 0.4]) if kind == "row" else HALF  # a row goes from one side of the table to the other
        scene = Arrangement(PARTS[part], half, np.random.default_rng((seed, draw)))
        try:
            ARRANGEMENTS[kind](scene)
        except NoRoom:
            continue
        return scene.placed
    raise AssertionError(f"no {kind} in 50 draws")


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("kind", ARRANGEMENTS)
def test_objects_stand_on_the_table_or_on_each_other_without_overlap(kind, part):
    placed = arranged(kind, part, 0)
    assert (kind == "empty") == (len(placed) < 2)
    for one in placed:
        below = 0.0 if one.on is None else placed[one.on].pose[2, 3]
        assert one.pose[2, 3] >= below and one.shape.mesh.bounds[0, 2] == pytest.approx(0.0, abs=1e-9)
    outlines = [placed_footprint(one.shape, one.pose) for one in placed if one.on is None]
    for index, outline in enumerate(outlines):
        assert all(outline.intersection(other).area < 1e-6 for other in outlines[:index])
    assert (kind == "stacked") <= any(one.on is not None for one in placed)


def test_what_touches_is_no_farther_than_a_millimetre_and_a_half():
    placed = arranged("touching", "development", 3)
    first, second = (placed_footprint(one.shape, one.pose) for one in placed[:2])
    assert first.distance(second) < 0.002


@pytest.mark.parametrize("part", PARTS)
def test_a_seed_gives_one_table_with_its_truth(part):
    cloud, again = (synthetic_table("stacked", part, 5, 1) for _ in range(2))
    np.testing.assert_array_equal(cloud.points, again.points)
    np.testing.assert_array_equal(cloud.color, again.color)
    sizes = np.bincount(cloud.labels.ravel())
    assert len(sizes) >= 3 and sizes[1:].min() >= 400
    assert np.isfinite(cloud.points[cloud.labels > 0]).all()
    assert not cloud.labels[[0, -1]].any() and not cloud.labels[:, [0, -1]].any()
    assert not np.array_equal(cloud.labels, synthetic_table("stacked", part, 6, 1).labels)


@pytest.mark.parametrize("sensor", SENSORS, ids=lambda sensor: sensor.name)
def test_a_sensor_measures_a_plane_to_a_hundredth_and_smears_a_step(sensor):
    rng = np.random.default_rng(0)
    depth = np.full((240, 320), 1.0)
    depth[:, 160:] = 0.8
    plain = np.ones_like(depth)
    none = np.zeros(depth.shape, dtype=bool)
    seen = measured(depth, plain, none, none, sensor, rng)
    assert np.isfinite(seen).all()
    assert np.median(np.abs(seen[:, :150] - 1.0)) < 0.01 and np.median(np.abs(seen[:, 170:] - 0.8)) < 0.01
    assert (seen[:, 155:160] < 0.95).any()
    assert len(np.unique(seen[:, :150])) > 3
    dark = measured(depth, plain, none, ~none, sensor, rng)
    assert np.isnan(dark).mean() == pytest.approx(sensor.lost, abs=0.02)
    shadow = np.zeros_like(none)
    shadow[:, :20] = True
    behind = measured(depth, plain, shadow, none, sensor, rng)
    np.testing.assert_array_equal(np.isnan(behind), shadow)


def test_dark_surfaces_have_patches_without_depth():
    sensor = SENSORS[1]
    flat = np.full((120, 160), 1.0)
    nothing = np.zeros(flat.shape, dtype=bool)
    holes = np.isnan(measured(flat, flat, nothing, ~nothing, sensor, np.random.default_rng(1)))
    _, patches = ndimage.label(holes)
    assert holes.sum() / patches > 20


def test_the_other_eye_does_not_see_what_lies_left_of_a_near_surface():
    sensor = SENSORS[1]
    depth = np.full((4, 200), 1.0)
    depth[:, 100:] = 0.5
    shift = sensor.focal * sensor.baseline  # pixels: the difference of disparities of 0.5 m and 1 m
    hidden = shadowed(depth, sensor)
    assert hidden[:, 100 - int(shift) + 1 : 100].all() and not hidden[:, : 100 - int(shift) - 1].any()
    assert not hidden[:, 100:].any()


def test_a_plane_is_seen_at_its_angle():
    focal, tilt = 500.0, 0.8
    rows = (np.arange(120) + 0.5 - 60) / focal
    # A plane through the point a metre ahead, leaning away from the camera.
    depth = np.repeat((1.0 / (1.0 - rows * np.tan(tilt)))[:, None], 160, axis=1)
    columns = (np.arange(160) + 0.5 - 80) / focal
    sight = np.stack(np.broadcast_arrays(columns[None, :], rows[:, None], 1.0), axis=-1)
    normal = np.array([0.0, -np.sin(tilt), np.cos(tilt)])
    expected = np.abs(sight @ normal) / np.linalg.norm(sight, axis=-1)
    np.testing.assert_allclose(facing(depth, focal), expected, atol=0.01)
