"""Taught figures: kept in files, found by name, and never in the way of what is shipped."""

from dataclasses import replace

import pytest

from agent.errors import UsageError
from agent.figures.picture import picture
from agent.figures.taught import checked_name, figure_said, forget, taught_names, teach
from grounding.figures.names import VARIABLE, figure_named
from grounding.spec import StructureSpec


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "structures"))
    return tmp_path / "structures"


def tee(name):
    return replace(figure_named("letter T"), name=name, nouns=(name,))


def test_a_taught_figure_is_a_shape_until_it_is_removed(folder):
    figure, path = teach("the City Gate", tee)
    assert (figure.name, path, taught_names()) == ("city gate", folder / "city_gate.toml", ("city gate",))
    assert StructureSpec("city gate", size="small").shape == "city gate"
    assert figure_said("CITY GATE") == figure
    assert forget("city gate") == path and taught_names() == ()
    with pytest.raises(UsageError, match="no figure 'city gate' was taught; taught figures: none"):
        forget("city gate")


@pytest.mark.parametrize(("name", "says"), [
    ("circle", "'circle' is 'circle' already"), ("a row", "'row' is 'line' already"),
    ("gateway", "'gateway' is 'gate' already"),
    ("Letter t", "'letter t' is 'letter T' already"), ("T", "one to four words"), ("the", "legal: one to four words"),
    ("left", "a word with another meaning in instructions"),
    ("very long name of mine", "one to four words"), ("a/b", "letters and digits"),
    ("like this", "a word with another meaning in instructions"),
    ("word HI", "a word with another meaning in instructions"),
])  # fmt: skip
def test_names_that_cannot_be_given(name, says):
    with pytest.raises(UsageError, match=says):
        checked_name(name)


def test_pictures_show_strokes_from_above_and_blocks_from_the_front():
    gate = replace(figure_named("gate"), blocks=figure_named("gate").blocks_of(3)[0])
    assert picture(gate) == ["[##########]", "[##]    [##]"]
    lines = picture(figure_named("letter T"))
    assert set(lines[0]) == {"o"} and {line.strip() for line in lines[1:]} == {"o"}
    assert any(" " in line.strip() for line in picture(figure_named("chessboard")))
