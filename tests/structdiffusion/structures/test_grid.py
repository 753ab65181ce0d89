"""A grid holds on a lattice of even pitches whose last row alone is short, and fails just beyond."""

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import MAX_UNEVEN_PITCH
from structdiffusion.footprints import turned
from structdiffusion.structures.grid import Grid, rows_and_columns
from structdiffusion.structures.lattice import divisions, fit_lattice
from structdiffusion.structures.structure import LayoutError
from tests.structdiffusion.structures.handmade import at_places, failures, grid, moved, ring

SPEC = StructureSpec("grid")


@pytest.mark.parametrize(
    ("rows", "columns", "missing"),
    [(2, 2, 0), (2, 3, 0), (3, 2, 0), (3, 3, 0), (3, 3, 2), (2, 5, 0), (2, 4, 3), (3, 2, 1)],
)
def test_rows_and_columns_are_counted(rows, columns, missing):
    bodies = grid(rows, columns, missing=missing)
    assert failures(bodies, SPEC) == []
    assert Grid().rows_and_columns(bodies) == (rows, columns)
    np.testing.assert_allclose(Grid().centre(bodies), (0.45, 0.0), atol=1e-6)


@pytest.mark.parametrize("yaw", [0.1, -0.4, 0.7])
def test_a_turned_grid_is_fitted_exactly(yaw):
    points = turned(np.array([(0.1 * r, 0.08 * c) for r in range(3) for c in range(3)]), yaw)
    fit = fit_lattice(points)
    assert (fit.rows, fit.columns) == (3, 3) and fit.off < 1e-9 and fit.uneven < 1e-9


def test_an_object_off_its_place_and_an_uneven_pitch():
    bodies = grid(3, 3)
    assert failures([moved(bodies[4], 0.026), *bodies[:4], *bodies[5:]], SPEC) == ["distance to the lattice (m)"]
    for more, failed in ((MAX_UNEVEN_PITCH - 1e-3, []), (MAX_UNEVEN_PITCH + 1e-3, ["difference of pitches (m)"])):
        places = [(x, y) for x in (0, 0.1, 0.2) for y in (0, 0.1, 0.2 + more)]
        assert failures(at_places(np.array(places) - 0.1), SPEC) == failed


def test_a_hole_in_the_middle_a_row_and_a_ring_are_no_grids():
    holed = [body for k, body in enumerate(grid(3, 3)) if k != 4]
    assert failures(holed, SPEC)
    assert failures(at_places([(0, 0.08 * k) for k in range(4)]), SPEC)
    assert failures(ring(0.15, range(0, 360, 60)), SPEC)


def test_rows_and_columns_for_every_number_of_objects():
    assert [rows_and_columns(count) for count in range(4, 11)] == [
        (2, 2),
        (2, 3),
        (2, 3),
        (2, 4),
        (2, 4),
        (3, 3),
        (2, 5),
    ]
    assert (
        rows_and_columns(7, rows=3) == (3, 3)
        and rows_and_columns(6, columns=2) == (3, 2)
        and rows_and_columns(9, 3, 3) == (3, 3)
    )
    for count in range(4, 11):
        assert all((rows - 1) * columns < count <= rows * columns for rows, columns in divisions(count))


@pytest.mark.parametrize(
    ("count", "asked", "sentence"),
    [
        (7, (3, 3), "a grid of 3 by 3 takes 9 objects, got 7"),
        (4, (1, 4), "a grid of 1 by 4 is a line"),
        (5, (4, None), "5 objects cannot form a grid of 4 rows"),
        (4, (None, 4), "4 objects cannot form a grid of 4 columns"),
    ],
)
def test_rows_and_columns_that_these_objects_cannot_have(count, asked, sentence):
    with pytest.raises(LayoutError, match=sentence):
        rows_and_columns(count, *asked)
