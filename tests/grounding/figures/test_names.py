"""Names find the shipped figures, then the taught ones, then files; nothing is remembered that a file contradicts."""

import os
import string

import pytest

from grounding.figures.figure import FigureError
from grounding.figures.files import figure_text, write_figure
from grounding.figures.names import (
    LIBRARY,
    VARIABLE,
    figure_named,
    figure_names,
    figure_nouns,
    file_name,
    is_figure,
    taught_folder,
)
from grounding.structure_words import STRUCTURES

MINE = 'name = "my hook"\nnouns = ["hook"]\nstrokes = [[[0, 0], [1, 0]]]\nleast = 2\n'


@pytest.fixture
def taught(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    return tmp_path


def test_letters_digits_and_more_than_sixty_figures_are_there():
    names = figure_names()
    assert {f"letter {c}" for c in string.ascii_uppercase} | {f"digit {d}" for d in range(10)} < set(names)
    assert len(names) >= 60 and not set(names) & STRUCTURES.keys()


@pytest.mark.parametrize("name", figure_names())
def test_every_shipped_figure_is_found_by_its_name(name):
    figure = figure_named(name)
    assert figure.name == name and (LIBRARY / file_name(name)).read_text() == figure_text(figure)
    assert figure.legal and figure.least <= figure.legal[0] and figure_nouns()[name] == figure.nouns


def test_no_two_figures_share_a_noun():
    nouns = [noun for each in figure_nouns().values() for noun in each]
    assert len(set(nouns)) == len(nouns)
    assert not set(nouns) & {noun for words in STRUCTURES.values() for noun in words.words.nouns}


def test_a_taught_figure_is_found_and_read_again_when_it_is_written_again(taught):
    (taught / "my_hook.toml").write_text(MINE)
    assert figure_named("my hook").least == 2 and "my hook" in figure_names()
    (taught / "my_hook.toml").write_text(MINE.replace("least = 2", "least = 3"))
    os.utime(taught / "my_hook.toml", ns=(1, 1))
    assert figure_named("my hook").least == 3
    (taught / "my_hook.toml").unlink()
    assert not is_figure("my hook") and "my hook" not in figure_names()


def test_a_taught_figure_does_not_change_a_shipped_one(taught):
    write_figure(figure_named("heart"), taught / "heart.toml")
    (taught / "heart.toml").write_text(MINE.replace("my hook", "heart"))
    assert len(figure_named("heart").strokes[0]) > 2 and figure_nouns()["heart"] == ("heart",)


def test_a_file_can_stand_in_place_of_a_name(tmp_path):
    (tmp_path / "any.toml").write_text(MINE)
    name = f"like {tmp_path / 'any.toml'}"
    assert figure_named(name).name == name and figure_named(name).nouns == ("hook",)
    with pytest.raises(FigureError, match="cannot be read"):
        figure_named(f"like {tmp_path / 'other.toml'}")


def test_an_unknown_name_and_one_without_letters_are_said():
    with pytest.raises(FigureError, match="no figure is called 'unicorn'"):
        figure_named("unicorn")
    with pytest.raises(FigureError, match="letters and digits"):
        figure_named("!?")


def test_a_broken_taught_file_hides_no_other(taught):
    (taught / "broken.toml").write_text("name = [")
    (taught / "my_hook.toml").write_text(MINE)
    assert "my hook" in figure_names()


def test_the_folder_follows_the_configuration(tmp_path):
    assert taught_folder({VARIABLE: str(tmp_path)}) == tmp_path
    assert taught_folder({"XDG_CONFIG_HOME": str(tmp_path)}) == tmp_path / "structagent" / "structures"
    assert taught_folder({"HOME": str(tmp_path)}) == tmp_path / ".config" / "structagent" / "structures"
