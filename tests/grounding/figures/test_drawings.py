"""Drawings of language models: one line of a goal, checked as a user's file of a figure is."""

import math

import pytest

from grounding.figures.drawings import MOST_POINTS, drawing_shape, drawings_among, without_drawings
from grounding.figures.figure import FigureError
from grounding.figures.names import figure_named, is_figure
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.structure_words import words_of

SAILBOAT = {"strokes": [[[0, 1], [1, 0], [3, 0], [4, 1], [0, 1]], [[2, 1], [2, 4], [3.5, 2]]], "least": 7}
CACTUS = {
    "blocks": [{"x": 0, "level": 0, "width": 1}, {"x": 0, "level": 1, "width": 3}, {"x": -1, "level": 2, "width": 1}]
}


def test_a_drawing_is_a_figure_by_its_shape_alone():
    shape = drawing_shape("sailboat", SAILBOAT)
    figure = figure_named(shape)
    assert figure.name == shape and figure.nouns == ("sailboat",) and figure.least == 7
    assert [list(map(list, stroke)) for stroke in figure.strokes] == SAILBOAT["strokes"]
    assert words_of(shape).slots == ("size", "x_position", "y_position", "rotation")
    goal = Goal((StructurePart(shape, "large", objects=tuple(range(8))),))
    assert Goal.from_dict(goal.to_dict()) == goal
    assert str(goal) == "sailboat of 0, 1, 2, 3, 4, 5, 6, 7, large"


def test_blocks_stand_and_need_as_many_objects():
    figure = figure_named(drawing_shape("cactus", CACTUS | {"strokes": None, "least": None}))
    assert figure.stacked and figure.legal == (3,)


def test_names_of_drawings_are_found_and_left_out():
    one, other = drawing_shape("sailboat", SAILBOAT), drawing_shape("my cactus", CACTUS)
    assert without_drawings(f"a large {one} beside a {other}") == "a large sailboat beside a my cactus"
    assert drawings_among([one, None, "gate", other]) == {"sailboat": one, "my cactus": other}
    assert without_drawings("drawing a line of cups") == "drawing a line of cups"


@pytest.mark.parametrize(("drawing", "why"), [
    ({}, "one of strokes, pattern, blocks and places"),
    (None, "drawing cannot be None; legal: an object"),
    ({"strokes": [[[0, 0], [1, math.nan]]], "least": 2}, "strokes cannot have nan; legal: finite numbers"),
    ({"strokes": [[[0, 0], [1, 1e9]]], "least": 2}, "strokes cannot have 1e[+]09; legal: -1000 to 1000"),
    ({"strokes": [[[k, k % 2] for k in range(500)]], "least": 9}, f"500 points; .* of {MOST_POINTS} points"),
    ({"strokes": [[[k, 0], [k, 1]] for k in range(13)], "least": 24}, "13 strokes of 26 points; legal: up to 12"),
    ({"strokes": [[[1, 1]]], "least": 1}, "strokes of one point show nothing"),
    ({"strokes": [[[1, 1], [1, 1]]], "least": 1}, "strokes of one point show nothing"),
    ({"strokes": [[]], "least": 1}, "a stroke cannot be empty"),
    ({"strokes": [[[0, 0], [1, 1]]]}, "the key 'least' of a drawing is missing"),
    ({"strokes": [[[0, 0], [1, 1]], [[2, 0], [3, 1]]], "least": 3}, "strokes have 4 ends; legal: 4 to 24"),
    ({"strokes": [[[0, 0, 0], [1, 1, 1]]], "least": 2}, "legal: pairs of numbers"),
    ({"strokes": [[[0, 0], [1, 1]]], "least": 25}, "least cannot be 25; legal: whole numbers from 1 to 24"),
    ({"blocks": [{"x": 0, "level": 0}, {"x": 4, "level": 1}]}, "the block at x 4 of level 1 stands on nothing"),
    ({"blocks": [{"x": 0, "level": 0}, {"x": 0.5, "level": 0}]}, "at x 0 and 0.5 of level 0 overlap"),
    ({"blocks": [{"x": k, "level": 0} for k in range(25)]}, "25 blocks; legal: up to 24"),
    ({"blocks": [{"x": 0, "level": 0}, {"x": 99, "level": 0}]}, "x 99 and width 1; legal: up to 24"),
    ({"blocks": [{"x": 0, "level": 0, "depth": 2}]}, "blocks cannot have"),
    ({"blocks": [{"x": 0, "level": 0}], "strokes": [[[0, 0], [1, 1]]]}, "one of strokes, pattern, blocks and places"),
    ({"pattern": ["x"], "least": 2}, "unknown key 'pattern' of a drawing; legal keys: strokes, blocks, least"),
])  # fmt: skip
def test_what_is_no_drawing_is_named(drawing, why):
    with pytest.raises(FigureError, match=why):
        drawing_shape("thing", drawing)


@pytest.mark.parametrize("shape", [
    "drawing", "drawing sailboat", "drawing sailboat <>", "drawing sailboat <[1]>", "drawing sailboat <{\"least\": 1}>",
    f"drawing x <{'[' * 5000}>",
])  # fmt: skip
def test_other_shapes_are_no_drawings(shape):
    assert not is_figure(shape)
