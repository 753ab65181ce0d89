"""Rectangles and squares hold near their outline, with objects at the corners and even gaps, and fail just beyond."""

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import MAX_OFF_CORNER, MAX_OFF_OUTLINE, MAX_SQUARE_SIDES_SHARE
from structdiffusion.structures.polygons import fit_rectangle, project, side_lengths
from structdiffusion.structures.rectangle import Rectangle
from tests.structdiffusion.structures.handmade import at_places, failures, moved, rectangle, ring, square, triangle

SPEC, SQUARE = StructureSpec("rectangle"), StructureSpec("square")


@pytest.mark.parametrize("yaw", [0.0, 0.3, 1.0, 2.5])
def test_a_rectangle_is_fitted_exactly_in_any_direction(yaw):
    bodies = rectangle(0.3, 0.15, yaw)
    points = np.array([body.centroid for body in bodies])
    corners = fit_rectangle(points)
    np.testing.assert_allclose(sorted(side_lengths(corners)), [0.15, 0.15, 0.3, 0.3], atol=1e-9)
    assert project(points, corners)[0].max() < 1e-9
    assert failures(bodies, SPEC) == []
    np.testing.assert_allclose(Rectangle().centre(bodies), (0.45, 0.0), atol=1e-9)


@pytest.mark.parametrize(
    ("off", "failed"), [(MAX_OFF_OUTLINE - 2e-3, []), (MAX_OFF_OUTLINE + 4e-3, ["distance to the outline (m)"])]
)
def test_an_object_inside_the_outline(off, failed):
    """One of nine on a square of 36 cm moves in: the others hold the least-squares outline where it was."""
    a = 0.18
    places = [(-a, -a), (0, -a), (a, -a), (a, 0), (a, a), (0, a), (-a, a), (-a, 0)]
    places[3] = (a - 1.5 * off, 0)  # the side follows it by a third
    assert failures(at_places(places), SPEC) == failed


def test_an_empty_corner_is_no_rectangle():
    bodies = rectangle(0.3, 0.3)
    assert failures(bodies, SPEC) == []
    lost = moved(bodies[0], 0.08)
    assert "corner to its object (m)" in failures(
        [lost, *bodies[1:]], SPEC
    ) or "distance to the outline (m)" in failures([lost, *bodies[1:]], SPEC)


def test_four_objects_at_a_kite_are_no_rectangle():
    kite = at_places([(0, 0), (0.2, 0.05), (0.4, 0), (0.2, -0.05)])
    assert failures(kite, SPEC)
    assert MAX_OFF_CORNER < 0.05


def test_a_gap_of_twice_the_mean_is_too_large():
    """Five objects between two corners, and none on the three other sides of a square."""
    a = 0.2
    places = [(a * k / 3, -a) for k in range(-3, 4)] + [(a, a), (-a, a)]
    assert failures(at_places(places), SPEC) == ["largest gap along the outline / mean gap"]


def test_a_square_has_about_equal_sides():
    assert failures(square(), SQUARE) == []
    for share, failed in (
        (MAX_SQUARE_SIDES_SHARE - 0.01, []),
        (MAX_SQUARE_SIDES_SHARE + 0.01, ["difference of the sides / longer side"]),
    ):
        bodies = [body for k, body in enumerate(rectangle(0.2, 0.2 * (1 - share))) if k not in (1, 4)]
        assert failures(bodies, SQUARE) == failed
        assert failures(bodies, SPEC) == []


def test_objects_in_one_line_are_no_rectangle():
    assert failures(at_places([(0, 0.08 * k) for k in range(-2, 3)]), SPEC)


def test_a_triangle_and_a_ring_are_no_rectangles():
    assert failures(triangle(0.3), SPEC) and failures(ring(0.15, range(0, 360, 45)), SQUARE)
