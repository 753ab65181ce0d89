"""Rows and columns in which objects stand already."""

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_reading.scene_references import SceneReferences
from grounding.goal_reading.standing_rows import standing_row
from grounding.references.attributes import SceneObject


def row(text, scene="blocks", opposite=False):
    return standing_row(text, SceneReferences(goal_scenes()[scene], None, False, opposite))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("the front row of blocks", [0, 1, 2]),
        ("back row", [6, 7, 8]),
        ("the middle row", [3, 4, 5]),
        ("the left-hand column", [2, 5, 8]),
        ("the rightmost column", [0, 3, 6]),
        ("the left row", None),
        ("the back row of cups", None),
        ("the row of blocks", None),
    ],
)
def test_nine_blocks_stand_in_three_rows_and_three_columns(text, found):
    assert row(text) == found


def test_across_the_table_the_back_row_is_the_front_row():
    assert row("the back row", opposite=True) == row("the front row")
    assert row("the left-hand column", opposite=True) == row("the right-hand column")


def test_where_no_rows_stand_none_is_chosen():
    assert row("the front row", "tall and short") is None
    nameless = SceneReferences([SceneObject("block"), SceneObject("block")], None, False, False)
    assert standing_row("the front row", nameless) is None
