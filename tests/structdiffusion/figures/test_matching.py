"""Objects are matched to places in any order, turned and scaled; gaps become even without leaving the strokes."""

import math
from itertools import pairwise

import numpy as np
import pytest

from grounding.figures.names import figure_named
from structdiffusion.figures.curves import moved
from structdiffusion.figures.matching import evened, matched
from structdiffusion.figures.strokes import places_of, variation
from structdiffusion.footprints import clear_gap
from structdiffusion.objects.solids import circle_outline


@pytest.mark.parametrize("name", ("letter R", "heart", "spiral", "chessboard", "smiley"))
@pytest.mark.parametrize("angle", (0.0, 1.1, 3.0))
def test_order_heading_and_scale_are_found(name, angle):
    places = places_of(figure_named(name), figure_named(name).legal[2])
    order = np.random.default_rng(3).permutation(len(places.points))
    points = moved(places.points, 0.1, angle, np.array([0.4, 0.1]))[np.argsort(order)]
    match = matched(places, points, angle + 0.1)
    assert match.off < 0.04 and match.scale == pytest.approx(0.1)
    assert match.order.tolist() == order.tolist()
    assert math.remainder(match.heading - angle, 2 * math.pi) == pytest.approx(0.0, abs=1e-6)


def test_a_figure_that_looks_the_same_turned_faces_where_it_is_expected_to():
    places = places_of(figure_named("letter N"), 10)
    points = moved(places.points, 0.1, 0.0, np.zeros(2)) + np.random.default_rng(0).normal(0.0, 0.002, (10, 2))
    for start in (0.0, math.pi):
        assert abs(math.remainder(matched(places, points, start).heading - start, 2 * math.pi)) < 0.1


def test_another_figure_is_off():
    places = places_of(figure_named("letter T"), 8)
    other = places_of(figure_named("letter O"), 8).points * 0.1
    assert matched(places, other, 0.0).off > 0.1


def test_gaps_between_objects_of_different_widths_become_even():
    places = places_of(figure_named("letter L"), 7)
    outlines = [circle_outline(radius, 40) for radius in (0.03, 0.02, 0.035, 0.025, 0.03, 0.02, 0.03)]
    points = places.points * 0.25

    def uneven(at):
        there = [outline + place for outline, place in zip(outlines, at)]
        return max(
            variation(np.array([clear_gap(there[i], there[j]) for i, j in pairwise(chain)])) for chain in places.chains
        )

    even = evened(places, points, places.axes, outlines)
    assert uneven(even) < 0.3 * uneven(points)
    assert matched(places, even, 0.0).off < 0.05


def test_dots_stay_where_they_are():
    places = places_of(figure_named("chessboard"), 8)
    assert evened(places, places.points, places.axes, [circle_outline(0.1, 8)] * 8) is places.points
