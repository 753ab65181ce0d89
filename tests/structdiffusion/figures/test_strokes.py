"""Places keep ends, corners and junctions, as evenly as the number of objects allows."""

from itertools import pairwise

import numpy as np
import pytest

from grounding.figures.names import figure_named, shipped_names
from structdiffusion.figures.curves import chamfer, sampled
from structdiffusion.figures.strokes import places_of, variation

FLAT = [name for name in shipped_names() if not figure_named(name).stacked]


def off(places):
    step = 0.01 * places.width
    return chamfer(sampled(places.lines(places.points), step), sampled(places.curves, step)) / places.width


@pytest.mark.parametrize("name", FLAT)
def test_every_flat_figure_is_shown_by_all_its_usual_numbers(name):
    figure = figure_named(name)
    for count in figure.legal[:5]:
        places = places_of(figure, count)
        assert len(places.points) == count == len(places.axes)
        assert off(places) < 0.06, count
        distances = np.linalg.norm(places.points[:, None] - places.points, axis=-1) + 9 * np.eye(count)
        assert distances.min() > 0.05 * places.width, count
        dots = sum(len(stroke) == 1 for stroke in figure.strokes)
        assert len(places.chains) == len(figure.strokes) - dots
        closed = [stroke[0] == stroke[-1] for stroke in figure.strokes if len(stroke) > 1]
        assert [chain[0] == chain[-1] for chain in places.chains] == closed


def test_a_t_keeps_its_ends_and_its_junction():
    places = places_of(figure_named("letter T"), 7)
    kept = {tuple(point) for point in places.points[places.corners].round(3).tolist()}
    assert kept == {(0.0, 2.0), (0.7, 2.0), (1.4, 2.0), (0.7, 0.0)}
    bar, stem = places.chains
    assert len(set(bar) & set(stem)) == 1


def test_a_star_of_fifteen_keeps_its_tips_and_is_even():
    """Five tips and no inner corner: the corners that would make it uneven are passed."""
    places = places_of(figure_named("star"), 15)
    (chain,) = places.chains
    steps = np.array([np.linalg.norm(places.points[i] - places.points[j]) for i, j in pairwise(chain)])
    assert places.corners.sum() == 5 and variation(steps) < 0.1


def test_pairs_that_are_apart_are_not_joined():
    places = places_of(figure_named("letter U"), 9)
    (chain,) = places.chains
    assert (min(chain[0], chain[-1]), max(chain[0], chain[-1])) in places.apart()
    assert not {frozenset(step) for step in places.steps} & set(map(frozenset, places.apart()))


def test_a_number_that_cannot_show_it_is_refused():
    with pytest.raises(ValueError, match="'star' cannot be sampled at 11 places; legal: 10, 15 or 20"):
        places_of(figure_named("star"), 11)
    assert variation(np.array([1.0])) == 0.0
