"""Blocks and patterns have other numbers by rules that keep what the figure is; numbers that break it are not legal."""

import pytest

from grounding.figures.growth import FigureBlock, grown, levels_of, pattern_places, supports_of
from grounding.figures.names import figure_named


def rows(blocks):
    return [len(level) for level in levels_of(blocks)]


def test_a_gate_has_two_posts_of_any_height_and_one_lintel():
    gate = figure_named("gate")
    assert gate.legal[:4] == (3, 5, 7, 9)
    for count in gate.legal[:4]:
        (blocks,) = gate.blocks_of(count)
        assert rows(blocks) == [2] * (count // 2) + [1] and len(supports_of(blocks)[-1]) == 2
        assert [block.width > 1 for block in blocks] == [False] * (count - 1) + [True]
    assert gate.blocks_of(4) == () and gate.legal_numbers().startswith("3, 5, 7")


def test_stairs_rise_by_one():
    stairs = figure_named("stairs")
    assert stairs.legal == (3, 6, 10, 15, 21)
    (blocks,) = stairs.blocks_of(10)
    assert rows(blocks) == [4, 3, 2, 1]
    tops = {x: max(block.level for block in blocks if block.x == x) for x in (0, 1, 2, 3)}
    assert list(tops.values()) == [0, 1, 2, 3]


def test_a_wall_keeps_its_bond_in_rows_and_columns():
    wall = figure_named("brick wall")
    for count in wall.legal[:8]:
        for blocks in wall.blocks_of(count):
            own = supports_of(blocks)
            assert all(len(below) == 2 for below, block in zip(own, blocks) if block.level)
            assert all(lower - upper == 1 for lower, upper in zip(rows(blocks), rows(blocks)[1:]))
    assert [rows(blocks) for blocks in wall.blocks_of(9)] == [[4, 3, 2], [5, 4]]
    assert 4 not in wall.legal and 8 not in wall.legal


def test_a_bridge_gets_longer_or_higher():
    assert sorted(map(rows, figure_named("bridge").blocks_of(7))) == [[2, 2, 2, 1], [4, 3]]


def test_what_has_no_rule_has_one_number():
    assert figure_named("podium").legal == (4,)
    assert grown((FigureBlock(0, 0.0),), (), 9) == {1: ((FigureBlock(0, 0.0),),)}


def test_a_rule_that_does_not_fit_changes_nothing():
    columns = (FigureBlock(0, 0.0), FigureBlock(0, 1.0), FigureBlock(1, 0.0))
    assert set(grown(columns, ("posts", "steps", "rows"), 9)) == {3}


@pytest.mark.parametrize("count", (5, 8, 9, 12, 13, 18))
def test_a_chessboard_has_no_two_objects_side_by_side_and_fills_its_rectangle(count):
    places = pattern_places(("x.", ".x"), count)
    assert len(set(places)) == count and len({(x + y) % 2 for x, y in places}) == 1
    width, depth = (len({place[axis] for place in places}) for axis in (0, 1))
    assert max(width, depth) <= 2.5 * min(width, depth)
    assert count in (width * depth // 2, (width * depth + 1) // 2)


def test_a_number_that_makes_no_chessboard_is_not_legal():
    assert pattern_places(("x.", ".x"), 19) == () and 19 not in figure_named("chessboard").legal
