import math

import numpy as np
import pytest

from structdiffusion.evaluation_protocol import CLEARANCE
from structdiffusion.footprints import (
    centre_range,
    clear_gap,
    fit_circle,
    outline_centroid,
    overlap_depths,
    separation_along,
    separations_along,
    tightest_ring_radius,
    turned,
)
from structdiffusion.objects.solids import circle_outline
from structdiffusion.observation import Table


def rectangle(length: float, width: float) -> np.ndarray:
    return np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (length / 2, width / 2)


def test_turned_is_counter_clockwise():
    np.testing.assert_allclose(turned(np.array([[1.0, 0.0]]), math.pi / 2), [[0.0, 1.0]], atol=1e-12)


@pytest.mark.parametrize("share", [1.0, 0.5])
@pytest.mark.parametrize("seed", range(5))
def test_a_noisy_circle_is_recovered(seed, share):
    """Half an arc as well: the algebraic fit alone is pulled inward there."""
    rng = np.random.default_rng(seed)
    centre, radius = rng.uniform(-0.5, 0.5, 2), rng.uniform(0.05, 0.3)
    angles = rng.uniform(0, 2 * math.pi) + np.linspace(0, 2 * math.pi * share, 60)
    points = centre + radius * np.column_stack((np.cos(angles), np.sin(angles)))
    found_centre, found_radius = fit_circle(points)
    np.testing.assert_allclose((*found_centre, found_radius), (*centre, radius), atol=1e-8)
    noisy_centre, noisy_radius = fit_circle(points + rng.normal(0, 0.002, points.shape))
    assert np.linalg.norm(noisy_centre - centre) < 0.002
    assert abs(noisy_radius - radius) < 0.002


def test_the_fitted_circle_is_the_least_squares_one():
    rng = np.random.default_rng(9)
    points = rng.uniform(-0.2, 0.2, (6, 2))
    centre, radius = fit_circle(points)

    def cost(x, y, r):
        return ((np.linalg.norm(points - (x, y), axis=1) - r) ** 2).sum()

    best = cost(*centre, radius)
    for step in 1e-3 * rng.standard_normal((200, 3)):
        assert cost(centre[0] + step[0], centre[1] + step[1], radius + step[2]) >= best


def test_centroids_do_not_depend_on_where_the_outline_is():
    triangle = np.array([[0.0, 0.0], [0.06, 0.0], [0.0, 0.03]])
    for at in (0.0, 1.0, 1e6):
        np.testing.assert_allclose(outline_centroid(triangle + at) - at, [0.02, 0.01], atol=1e-9)
    for at in (5e9, 1e18):  # where an untrained network may put things: an outline is a point there, or nearly
        assert np.isfinite(outline_centroid(triangle + at)).all()
    np.testing.assert_allclose(outline_centroid(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]])), [1.0, 1.0])


def overlap_depth(a: np.ndarray, b: np.ndarray) -> float:
    return float(overlap_depths(a[None], b[None])[0])


def test_overlap_and_gap_of_rectangles():
    a, b = rectangle(0.2, 0.1), rectangle(0.1, 0.1)
    assert clear_gap(a, b + (0.18, 0.0)) == pytest.approx(0.03)
    assert overlap_depth(a, b + (0.18, 0.0)) == 0.0
    assert clear_gap(a, b + (0.14, 0.0)) == 0.0
    assert overlap_depth(a, b + (0.14, 0.0)) == pytest.approx(0.01)
    assert overlap_depth(a, b + (0.14, 0.095)) == pytest.approx(0.005)  # the shorter way out is sideways
    # Two diamonds whose bounding boxes overlap, and which do not.
    diamond = turned(rectangle(0.1, 0.1), math.pi / 4)
    assert overlap_depth(diamond, diamond + (0.08, 0.08)) == 0.0
    assert clear_gap(diamond, diamond + (0.08, 0.08)) == pytest.approx(0.08 * math.sqrt(2) - 0.1)


def test_overlaps_of_many_outlines_are_those_of_each_pair():
    rng = np.random.default_rng(3)
    boxes = np.array([turned(rectangle(0.1, 0.05), yaw) for yaw in rng.uniform(-3, 3, 40)])
    boxes += rng.uniform(-0.08, 0.08, (40, 1, 2))
    rings = np.array([circle_outline(radius, 12) for radius in rng.uniform(0.02, 0.06, 40)])
    depths = overlap_depths(boxes, rings)
    assert 5 < (depths > 0).sum() < 35
    np.testing.assert_allclose(depths, [overlap_depth(a, b) for a, b in zip(rings, boxes)], atol=1e-15)
    assert overlap_depths(boxes[:0], rings[:0]).shape == (0,)


def test_moving_by_the_overlap_parts_two_outlines():
    rng = np.random.default_rng(4)
    for _ in range(25):
        a = turned(rectangle(*rng.uniform(0.03, 0.2, 2)), rng.uniform(-3, 3))
        b = circle_outline(rng.uniform(0.02, 0.06), 12) + rng.uniform(-0.05, 0.05, 2)
        depth = overlap_depth(a, b)
        assert (depth > 0) == (clear_gap(a, b) == 0)
        away = np.linspace(0, 2 * math.pi, 361)
        shifts = 1.0001 * (depth + 1e-6) * np.column_stack((np.cos(away), np.sin(away)))
        parted = [overlap_depth(a, b + shift) < 1e-3 * depth + 1e-6 for shift in shifts]
        assert any(parted)


def test_separation_leaves_just_the_clearance():
    rng = np.random.default_rng(5)
    for _ in range(30):
        a = turned(rectangle(*rng.uniform(0.03, 0.2, 2)), rng.uniform(-3, 3))
        b = turned(rectangle(*rng.uniform(0.03, 0.2, 2)), rng.uniform(-3, 3))
        angle = rng.uniform(-3, 3)
        direction = np.array([math.cos(angle), math.sin(angle)])
        distance = separation_along(a, b, direction)
        assert clear_gap(a, b + distance * direction) == pytest.approx(CLEARANCE, abs=1e-4)


def test_separations_along_many_directions_are_those_along_each():
    a, b = turned(rectangle(0.2, 0.04), 0.3), circle_outline(0.05)
    angles = np.linspace(0, 2 * math.pi, 17)
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    each = [separation_along(a, b, direction, 0.02) for direction in directions]
    np.testing.assert_array_equal(separations_along(a, b, directions, 0.02), each)


@pytest.mark.parametrize("seed", range(6))
def test_the_tightest_ring_leaves_one_centimetre_between_the_closest_pair(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 8))
    angles = np.sort(rng.uniform(0, 2 * math.pi, count))
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    outlines = [turned(rectangle(*rng.uniform(0.03, 0.12, 2)), rng.uniform(-3, 3)) for _ in range(count)]
    radius = tightest_ring_radius(outlines, directions)

    def closest(r: float) -> float:
        placed = [outline + r * direction for outline, direction in zip(outlines, directions)]
        return min(clear_gap(a, b) for i, a in enumerate(placed) for b in placed[i + 1 :])

    assert closest(radius) == pytest.approx(CLEARANCE, abs=2e-4)
    assert closest(0.97 * radius) < CLEARANCE


def test_six_discs_make_the_ring_that_trigonometry_says():
    angles = np.arange(6) * math.pi / 3
    outlines = [circle_outline(0.03, 360)] * 6
    radius = tightest_ring_radius(outlines, np.column_stack((np.cos(angles), np.sin(angles))))
    assert radius == pytest.approx(0.07, rel=2e-3)  # neighbours are as far apart as the centre: 2 * 3 cm + 1 cm


def test_the_centres_range_keeps_everything_on_the_table():
    table = Table()
    outlines = [rectangle(0.1, 0.1) + (0.3, 0.2), rectangle(0.05, 0.05) + (0.45, 0.0)]
    centre = np.array([0.35, 0.1])
    (x_low, x_high), (y_low, y_high) = centre_range(outlines, centre, table)
    for corner in ((x_low, y_low), (x_high, y_high)):
        moved = np.concatenate(outlines) + np.array(corner) - centre
        assert table.overhang(moved) == pytest.approx(0.0, abs=1e-12)
        beyond = moved + 0.01 * np.sign(np.array(corner) - centre)
        assert table.overhang(beyond) == pytest.approx(0.01)


def test_squares_side_by_side_and_corner_to_corner():
    """Parallel sides, and directions that leave right through a corner: by hand."""
    square = rectangle(0.06, 0.06)
    for angle in np.arange(16) * math.pi / 8:
        direction = np.array([math.cos(angle), math.sin(angle)])
        needed = separation_along(square, square, direction, 0.01)
        assert clear_gap(square, square + needed * direction) == pytest.approx(0.01, abs=1e-9)
    diagonal = np.array([1.0, 1.0]) / math.sqrt(2)
    assert separation_along(square, square, diagonal, 0.01) == pytest.approx(0.06 * math.sqrt(2) + 0.01)
    assert separation_along(square, square, np.array([1.0, 0.0]), 0.01) == pytest.approx(0.07)
