"""Parts of a table: what hides a strip of it does not divide it, a floor that is seen between two tables does."""

import numpy as np
import pytest

from agent.perception.height_map import table_relief
from agent.perception.table_parts import parts_joined, seen_through

EYE = np.array([-0.6, 0.0, 0.8])


@pytest.fixture
def halves():
    cells = np.zeros((40, 30), dtype=bool)
    cells[2:18, 2:28] = cells[24:38, 2:28] = True
    parts = np.zeros(cells.shape, dtype=int)
    parts[2:18, 2:28], parts[24:38, 2:28] = 1, 2
    return parts, cells


def test_a_gap_through_which_nothing_is_seen_is_the_table(halves):
    parts, cells = halves
    assert (parts_joined(parts, cells, np.zeros_like(cells))[cells] == 1).all()


def test_a_gap_with_the_floor_in_it_ends_the_table(halves):
    parts, cells = halves
    through = np.zeros_like(cells)
    through[19:23:2, 1:29:2] = True  # from afar, a floor is not seen through every cell
    np.testing.assert_array_equal(parts_joined(parts, cells, through), parts)


def test_what_is_farther_than_half_a_metre_is_no_part(halves):
    parts, cells = (np.pad(each, ((0, 30), (0, 0))) for each in halves)
    far = np.zeros_like(cells)
    far[66:70, 2:28] = True
    parts[far] = 3
    assert set(np.unique(parts_joined(parts, cells | far, np.zeros_like(cells))[far])) == {3}


def test_the_floor_is_seen_through_the_cell_that_the_line_of_sight_crosses():
    place = np.array([0.31, 0.11])
    floor = EYE + 1.7 * (np.array([*place, 0.0]) - EYE)
    cells = seen_through(np.array([floor, [0.1, 0.1, 0.0]]), EYE, np.zeros(2), (20, 10))
    assert np.argwhere(cells).tolist() == [[15, 5]]


def table_with_a_gap(floor):
    """Points of two level surfaces with 10 cm between them, as the camera at EYE sees them; with or without a floor."""
    x, y = np.meshgrid(np.arange(0.0, 0.8, 0.005), np.arange(-0.3, 0.3, 0.005), indexing="ij")
    gap = (x > 0.4) & (x < 0.5)
    z = np.random.default_rng(0).normal(0.0, 0.0005, x.shape)
    points = np.stack((x, y, z), axis=-1)
    points[gap] = EYE + (points[gap] - EYE) * 1.8
    return points[~gap] if not floor else np.concatenate((points[~gap], points[gap]))


@pytest.mark.parametrize("floor", [False, True])
def test_the_outline_ends_at_a_gap_that_shows_the_floor_and_the_rest_is_named(floor):
    level = table_with_a_gap(floor)
    relief = table_relief(level, EYE, np.linalg.norm(level - EYE, axis=1), np.arange(len(level)), (1, len(level)))
    assert relief.outline.bounds[2] == pytest.approx(0.4 if floor else 0.795, abs=0.03)
    assert len(relief.apart) == floor
    if floor:
        x, y, area = relief.apart[0]
        assert (x, y) == (pytest.approx(0.65, abs=0.02), pytest.approx(0.0, abs=0.02))
        assert area == pytest.approx(0.3 * 0.6, rel=0.1)
