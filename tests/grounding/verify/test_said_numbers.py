"""A number that is said is in the goal, or is known to be lost."""

import pytest

from grounding.goals.goal import Goal
from grounding.verify.said_numbers import lost_numbers

LINE = {"kind": "structure", "shape": "line", "objects": [0, 1, 2]}


@pytest.mark.parametrize(
    ("text", "part", "phrases", "lost"),
    [
        ("put objects 3 and 4 in a line", {}, ("objects",), ("3", "4")),
        ("put cups 1 and 3 in a line", {}, ("cups",), ("1", "3")),
        ("put cups 1 and 3 in a line", {}, ("cup 1", "cup 3"), ()),
        ("put three cups in a line", {}, ("three cups",), ()),
        ("a line, all three of the cups", {}, ("the cups",), ()),
        ("put the cups in two lines", {}, ("the cups",), ("two",)),
        ("a line of the cups, 5 cm apart", {"gap": 0.05}, ("the cups",), ()),
        ("a line of the cups, 5 apart", {"gap": 0.05}, ("the cups",), ()),
        ("a line of the cups, 5 cm apart, or no, better 3", {"gap": 0.05}, ("the cups",), ()),  # there are three
        ("a line of the cups, 5 cm apart, or no, better 4", {"gap": 0.05}, ("the cups",), ("4",)),
        ("two inches between the cups", {"gap": 0.0508}, ("the cups",), ()),
        ("line the cups up, half a metre long", {"length": 0.5}, ("the cups",), ()),
        ("line the cups up, half a metre long", {"length": 0.05}, ("the cups",), ("half a metre",)),
        ("the green one next to the blue one", {}, ("the green one",), ()),
        ("dinner is at eight, so line up the cups", {}, ("the cups",), ("eight",)),
    ],
)
def test_numbers(text, part, phrases, lost):
    assert lost_numbers(text, Goal.from_dict({"parts": [LINE | part]}), phrases) == lost


def test_a_circle_may_be_said_by_its_diameter():
    goal = Goal.from_dict({"parts": [{"kind": "structure", "shape": "circle", "objects": [0, 1, 2], "radius": 0.1}]})
    assert lost_numbers("a circle 20 cm across", goal, ()) == () != lost_numbers("a circle 30 cm across", goal, ())


def test_rows_and_parts_are_counted():
    grid = Goal.from_dict({"parts": [LINE | {"shape": "grid", "objects": [0, 1, 2, 3, 4, 5], "rows": 2, "columns": 3}]})
    assert lost_numbers("the cups 2 by 3", grid, ("the cups",)) == ()
    lines = Goal.from_dict({"parts": [LINE, LINE | {"objects": [3, 4]}]})
    assert lost_numbers("the cups and the cans in two lines", lines, ("the cups", "the cans")) == ()


def test_numbers_of_the_goal_so_far_may_be_repeated():
    before = Goal.from_dict({"parts": [LINE | {"gap": 0.05}]})
    assert lost_numbers("not 5 cm, 8 cm", Goal.from_dict({"parts": [LINE | {"gap": 0.08}]}), (), before) == ()
