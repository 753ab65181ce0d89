"""A cross holds with straight lines at right angles and an object on each arm, and fails just beyond."""

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import MAX_CROSS_OFF_DEGREES
from structdiffusion.footprints import turned
from structdiffusion.structures.cross import Cross, fit_cross
from tests.structdiffusion.structures.handmade import at_places, cross, failures, grid, moved, ring

SPEC = StructureSpec("cross")


@pytest.mark.parametrize("yaw", [0.0, 0.4, 1.2])
def test_a_cross_is_fitted_exactly_in_any_direction(yaw):
    places = turned(np.array([(0, 0), (0.1, 0), (0, 0.1), (-0.1, 0), (0, -0.1), (0.2, 0)]), yaw)
    fit = fit_cross(places)
    assert (
        fit.middle == 0 and fit.arms == 4 and fit.off_line < 1e-9 and fit.missed < 1e-9 and fit.off_right_angle < 1e-4
    )
    assert failures(at_places(places), SPEC) == []
    np.testing.assert_allclose(Cross().centre(at_places(places)), (0.45, 0.0), atol=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
def test_lines_off_a_right_angle(sign):
    assert failures(cross(degrees=90 + sign * (MAX_CROSS_OFF_DEGREES - 0.5)), SPEC) == []
    assert failures(cross(degrees=90 + sign * (MAX_CROSS_OFF_DEGREES + 0.5)), SPEC) == ["lines off a right angle (deg)"]


def test_a_missing_arm_and_an_object_off_its_line():
    tee = at_places([(0, 0), (0.1, 0), (-0.1, 0), (0, 0.1), (0, 0.2)])
    assert failures(tee, SPEC) == ["arms with an object"]
    bodies = cross(0.12)
    assert "distance to the lines (m)" in failures([*bodies[:5], moved(bodies[5], dy=0.09)], SPEC)


def test_an_empty_crossing_is_no_cross():
    assert failures(at_places([(0.1, 0), (0.2, 0), (-0.1, 0), (0, 0.1), (0, -0.1)]), SPEC)


def test_grids_and_rings_are_no_crosses():
    assert failures(grid(3, 3), SPEC) and failures(ring(0.15, range(0, 360, 72)), SPEC)


def test_neighbours_go_through_the_crossing():
    pairs = {frozenset(pair) for pair in Cross().neighbours(cross(), SPEC)}
    assert pairs == {frozenset(pair) for pair in ((0, 1), (0, 2), (0, 3), (0, 4), (1, 5))}
