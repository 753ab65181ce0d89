"""Figures are read off what stands: strokes with their ends, closures and junctions, patterns,
blocks and how they grow.
"""

from itertools import pairwise

import numpy as np
import pytest

from grounding.figures.figure import FigureError
from grounding.figures.growth import supports_of
from grounding.figures.names import figure_named
from structdiffusion.figures.blocks import places_along
from structdiffusion.figures.curves import chamfer, moved, sampled
from structdiffusion.figures.example import Example, figure_of, strokes_through
from structdiffusion.figures.matching import matched
from structdiffusion.figures.strokes import places_of
from structdiffusion.models.strokes.reading import read_strokes

SQUARE = 0.02 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


PLAIN = (("letter L", 6), ("letter C", 8), ("letter O", 9), ("letter T", 8), ("wave", 10), ("letter Y", 8))
UNTRAINED = ("letter V", "heart", "spiral", "zigzag", "smiley", "star")


def flat(points):
    outlines = tuple(SQUARE + point for point in points)
    return Example(outlines, np.array(points), ((),) * len(points), np.zeros(len(points)))


def drawn(name, count):
    return flat(moved(places_of(figure_named(name), count).points, 0.1, 0.4, np.array([0.1, 0.2])))


def upright(name, count, width=0.05, beam=0.1):
    (blocks, *_) = figure_named(name).blocks_of(count)
    widths = [beam if block.width > 1 else width for block in blocks]
    middles = places_along(blocks, widths)
    outlines = tuple(
        np.array([[-w / 2, -0.02], [w / 2, -0.02], [w / 2, 0.02], [-w / 2, 0.02]]) + (x, 0.3)
        for w, x in zip(widths, middles)
    )
    return Example(
        outlines,
        np.array([(x, 0.3) for x in middles]),
        supports_of(blocks),
        np.array([0.05 * block.level for block in blocks]),
    )


@pytest.mark.parametrize(("name", "count"), PLAIN)
def test_what_is_joined_is_what_the_drawing_joins(name, count):
    example = drawn(name, count)
    strokes = strokes_through(example.middles, read_strokes(example).joined)
    joined = {frozenset(step) for stroke in strokes for step in pairwise(stroke)}
    assert joined == set(map(frozenset, places_of(figure_named(name), count).steps))
    assert {i for stroke in strokes for i in stroke} == set(range(count))


def test_dots_beside_a_stroke_are_no_stroke():
    angles = np.arange(12) * np.pi / 6
    ring = 0.134 * np.column_stack((np.cos(angles), np.sin(angles)))
    joined = read_strokes(flat(np.vstack((ring, [(-0.05, 0.02), (0.05, 0.02)])))).joined
    assert (joined.sum(axis=1) == [2] * 12 + [0] * 2).all()


@pytest.mark.parametrize("name", UNTRAINED)
def test_an_example_shows_the_figure_with_another_number(name):
    figure = figure_named(name)
    count, other = (10, 20) if name == "star" else (figure.legal[3], figure.legal[3] + 4)
    taught = figure_of(drawn(name, count), "taught", ("taught",), read_strokes)
    assert other in taught.legal
    match = matched(places_of(figure, other), places_of(taught, other).points, 0.0)
    assert match.off < 0.08


def test_a_stroke_is_a_curve_between_its_corners():
    corner = figure_of(drawn("letter L", 6), "taught", ("taught",), read_strokes)
    ring = figure_of(drawn("letter O", 9), "taught", ("taught",), read_strokes)
    (bent,), (round_one,) = corner.strokes, ring.strokes
    turns = [
        np.abs(np.diff(np.unwrap(np.arctan2(*np.diff(np.array(line), axis=0).T[::-1])))) for line in (bent, round_one)
    ]
    assert np.degrees(turns[0].max()) > 80 and np.degrees(turns[1].max()) < 20 and round_one[0] == round_one[-1]


def test_a_chessboard_is_a_pattern_that_goes_on():
    taught = figure_of(drawn("chessboard", 8), "board", ("board",), read_strokes)
    assert taught.pattern and {5, 12, 13} <= set(taught.legal)


@pytest.mark.parametrize(
    ("name", "count", "grows", "others"),
    [
        ("gate", 5, ("posts",), (3, 7)),
        ("stairs", 6, ("steps",), (3, 10)),
        ("brick wall", 5, ("rows", "columns"), (3, 7, 9)),
        ("castle", 6, ("posts",), (8,)),
    ],
)
def test_blocks_that_stand_on_each_other_grow_as_the_figure_does(name, count, grows, others):
    taught = figure_of(upright(name, count), "taught", ("taught",), read_strokes)
    assert taught.grows == grows
    for number in (count, *others):
        assert supports_of(taught.blocks_of(number)[0]) == supports_of(figure_named(name).blocks_of(number)[0])


def test_the_lintel_bridges_and_the_posts_do_not():
    taught = figure_of(upright("gate", 3), "taught", ("taught",), read_strokes)
    assert [block.width > 1 for block in taught.blocks] == [False, False, True]


def test_what_cannot_be_taught_is_said():
    with pytest.raises(FigureError, match="two objects or more"):
        figure_of(flat([(0.0, 0.0)]), "dot", ("dot",), read_strokes)
    one = upright("gate", 3)
    apart = Example(one.outlines, one.middles + [(0, 0), (0, 0.3), (0, 0)], one.rests_on, one.bottoms)
    with pytest.raises(FigureError, match="only as one wall"):
        figure_of(apart, "bent", ("bent",), read_strokes)


def test_an_outline_is_kept_in_its_own_shape():
    example = drawn("letter S", 9)
    taught = figure_of(example, "taught", ("taught",), read_strokes)
    one = sampled([np.array(stroke) for stroke in taught.strokes], 0.02)
    scale = 2.0 / np.linalg.norm(example.middles[:, None] - example.middles, axis=-1).max()
    assert chamfer(one, (example.middles - example.middles.mean(axis=0)) * scale) < 0.2
