"""Flat things of another colour than the table: a step makes them, a stain is none, and no sensor's noise is one."""

import numpy as np
import pytest
import shapely

from agent.perception.flat_things import TableView, with_flat_things
from agent.synthetic_tables.sensors import SENSORS, measured

EYE = np.array([0.0, 0.0, 0.9])
SHAPE, FOCAL = (240, 320), 300.0
OUTLINE = shapely.box(-0.45, -0.34, 0.45, 0.34)
ROWS, COLUMNS = np.mgrid[: SHAPE[0], : SHAPE[1]]
BOOK = (np.abs(ROWS - 120) < 25) & (np.abs(COLUMNS - 170) < 35)


def looked_at(patch, thick, sensor=None, seed=0, labels=None):
    """Labels (H, W) of a level table below the camera, with a patch of another colour and thickness."""
    rng = np.random.default_rng(seed)
    depth = np.where(patch, EYE[2] - thick, EYE[2]) + rng.normal(0.0, 0.0005, SHAPE)
    if sensor is not None:
        plain, none = np.ones(SHAPE), np.zeros(SHAPE, dtype=bool)
        depth = measured(np.where(patch, EYE[2] - thick, EYE[2]), plain, none, none, sensor, rng)
    x, y = (COLUMNS - SHAPE[1] / 2) / FOCAL * depth, (ROWS - SHAPE[0] / 2) / FOCAL * depth
    level = np.stack((x, y, EYE[2] - depth), axis=-1).reshape(-1, 3)
    contrast = np.where(patch, 9.0, np.abs(rng.normal(0.0, 1.0, SHAPE))).ravel()
    known = np.full(level.shape[0], -1) if labels is None else labels.ravel()
    view = TableView(level, level[:, 2], contrast, np.arange(len(level)), SHAPE, EYE, OUTLINE)
    found = with_flat_things(known, view)
    return found.reshape(SHAPE)


def test_a_book_of_four_millimetres_is_found():
    found = looked_at(BOOK, 0.004)
    assert found.max() == 0 and ((found == 0) & BOOK).sum() > 0.9 * ((found == 0) | BOOK).sum()


def test_a_stain_is_nothing():
    assert looked_at(BOOK, 0.0).max() == -1


@pytest.mark.parametrize("sensor", SENSORS, ids=lambda sensor: sensor.name)
def test_stains_are_nothing_to_any_sensor(sensor):
    stains = BOOK | (np.hypot(ROWS - 60, COLUMNS - 70) < 22) | ((np.abs(ROWS - 200) < 6) & (np.abs(COLUMNS - 220) < 40))
    assert all(looked_at(stains, 0.0, sensor, seed).max() == -1 for seed in range(3))


def test_parts_that_were_known_by_their_height_are_one_with_the_rest():
    known = np.full(SHAPE, -1)
    known[BOOK & (COLUMNS < 160)] = 0
    found = looked_at(BOOK, 0.006, labels=known)
    assert found.max() == 0 and (found[BOOK] == 0).mean() > 0.9


def test_a_known_object_that_is_high_keeps_its_points():
    known, patch = np.full(SHAPE, -1), BOOK & (COLUMNS > 160)
    known[(np.abs(ROWS - 120) < 25) & (np.abs(COLUMNS - 100) < 20)] = 0
    found = looked_at(patch, 0.005, labels=known)
    np.testing.assert_array_equal(found == 0, known == 0)
    assert (found[patch] == 1).mean() > 0.9
