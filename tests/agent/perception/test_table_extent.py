"""The part of a table that can be built on, and what is noted of the rest."""

import pytest

from agent.perception.table_extent import reachable
from structdiffusion.observation import Table

REACH = Table()


def test_a_table_beyond_the_reach_is_cut_off_without_a_note():
    assert reachable(Table(0.0, 1.2, -1.0, 1.0)) == (REACH, ())


@pytest.mark.parametrize(
    ("side", "seen"), [("x_min", 0.3), ("x_max", 0.6), ("y_min", -0.2), ("y_max", 0.1)], ids=lambda value: str(value)
)
def test_what_the_picture_does_not_show_of_the_reach_is_noted(side, seen):
    surface = Table(**{"x_min": 0.0, "x_max": 1.0, "y_min": -1.0, "y_max": 1.0, side: seen})
    table, (note,) = reachable(surface)
    assert getattr(table, side) == seen
    assert note.startswith("of what the arm reaches, the table was seen from x") and f"{seen:.2f}" in note


def test_a_table_that_is_hardly_within_reach_is_built_on_beyond_what_was_seen():
    table, (note,) = reachable(Table(0.65, 1.5, -0.3, 0.3))
    assert table.x_max - table.x_min == pytest.approx(0.2) and "goes beyond" in note
