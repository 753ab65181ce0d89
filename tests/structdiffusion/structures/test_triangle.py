"""A triangle holds with its corners taken, its angles moderate and a corner where it points, and fails just beyond."""

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import TRIANGLE_ANGLES_DEGREES
from structdiffusion.structures.polygons import fit_triangle, inner_angles, side_lengths
from structdiffusion.structures.triangle import Triangle
from tests.structdiffusion.structures.handmade import HEADINGS, at_places, failures, moved, rectangle, triangle

SPEC = StructureSpec("triangle")


@pytest.mark.parametrize("degrees", [0, 17, 90, 200])
def test_a_triangle_is_fitted_exactly_in_any_direction(degrees):
    bodies = triangle(0.25, degrees)
    corners = fit_triangle(np.array([body.centroid for body in bodies]))
    np.testing.assert_allclose(side_lengths(corners), 0.25, atol=1e-9)
    np.testing.assert_allclose(inner_angles(corners), 60.0, atol=1e-6)
    np.testing.assert_allclose(Triangle().centre(bodies), (0.45, 0.0), atol=1e-9)
    assert failures(bodies, SPEC) == []


@pytest.mark.parametrize(
    ("apex", "failed"),
    [
        (TRIANGLE_ANGLES_DEGREES[0] + 0.5, []),
        (TRIANGLE_ANGLES_DEGREES[0] - 0.5, ["smallest angle (deg)"]),
        (TRIANGLE_ANGLES_DEGREES[1] - 0.5, []),
        (TRIANGLE_ANGLES_DEGREES[1] + 0.5, ["largest angle (deg)"]),
    ],
)
def test_angles_have_limits(apex, failed):
    assert failures(triangle(0.3, apex=apex), SPEC) == failed


@pytest.mark.parametrize("rotation", HEADINGS)
def test_a_corner_points_where_it_should(rotation):
    spec = StructureSpec("triangle", rotation=rotation)
    for off in (-29, 0, 29):
        assert failures(triangle(0.25, HEADINGS[rotation] + off), spec) == []
    # The next corner is a third of a turn away: between two, none is within 30 degrees.
    for off in (-45, 45, 60):
        assert failures(triangle(0.25, HEADINGS[rotation] + off), spec) == ["nearest corner's heading (deg off)"]


def test_an_object_off_the_outline_and_an_empty_corner():
    bodies = triangle(0.36)
    assert "distance to the outline (m)" in failures([*bodies, at_places([(0, 0)])[0]], SPEC)
    assert failures([moved(bodies[0], -0.16), *bodies[1:]], SPEC)


def test_three_in_a_row_are_no_triangle():
    assert failures(at_places([(0, 0.1 * k) for k in (-1, 0, 1)]), SPEC)


def test_squares_are_no_triangles():
    assert failures(rectangle(0.3, 0.3), SPEC)
