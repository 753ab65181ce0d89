"""`structagent structures` and `structagent teach`, and `run --like` up to the goal."""

import json

import pytest

from agent.cli.app import command_line
from agent.errors import BAD_INPUT, DONE, USAGE
from grounding.figures.names import VARIABLE, figure_names

SCENE = """\
version: 1
objects:
- {mesh: ycb/065-a_cups, x: 0.30, y: 0.2}
- {mesh: ycb/065-b_cups, x: 0.40, y: 0.1}
- {mesh: ycb/065-c_cups, x: 0.50, y: 0.0}
- {mesh: ycb/065-d_cups, x: 0.40, y: -0.1}
- {mesh: ycb/065-e_cups, x: 0.30, y: -0.2}
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "structures"))
    (tmp_path / "roof.yaml").write_text(SCENE)
    return tmp_path


def test_list_has_every_figure_and_its_numbers(capsys):
    assert command_line(["structures", "list", "--json"]) == DONE
    rows = json.loads(capsys.readouterr().out)
    assert [row["name"] for row in rows] == list(figure_names()) and not any(row["taught"] for row in rows)
    assert next(row for row in rows if row["name"] == "gate")["numbers"][:3] == [3, 5, 7]


def test_show_draws_a_figure_and_names_its_file(capsys):
    assert command_line(["structures", "show", "Letter t"]) == DONE
    shown = capsys.readouterr().out
    assert "letter T: 4 or more objects; said as letter T, capital T, T" in shown and "letter_t.toml" in shown
    assert command_line(["structures", "show", "giraffe"]) == BAD_INPUT
    assert "no figure is called 'giraffe'; `structagent structures list` shows all" in capsys.readouterr().err


def test_what_is_taught_is_read_listed_and_removed(folder, capsys):
    teach = ["teach", "roof", "--from", str(folder / "roof.yaml")]
    assert command_line(teach) == DONE
    assert (folder / "structures" / "roof.toml").read_text().startswith('name = "roof"\nnouns = ["roof"]\nstrokes = [')
    assert command_line(teach) == BAD_INPUT and "--force replaces it" in capsys.readouterr().err
    assert command_line([*teach, "--force"]) == DONE
    capsys.readouterr()
    assert (
        command_line(["parse", "a roof of the cans on the left", "--objects", "can,can,can,can,cup", "--json"]) == DONE
    )
    (part,) = json.loads(capsys.readouterr().out)["goal"]["parts"]
    assert (part["shape"], part["x_position"], part["objects"]) == ("roof", "left", [0, 1, 2, 3])
    assert command_line(["structures", "remove", "roof"]) == DONE and "removed" in capsys.readouterr().err
    assert command_line(["structures", "remove", "roof"]) == USAGE


def test_names_that_are_taken_and_files_that_show_nothing(folder, capsys):
    assert command_line(["teach", "heart", "--from", str(folder / "roof.yaml")]) == USAGE
    assert "'heart' is 'heart' already, which comes with structagent" in capsys.readouterr().err
    assert command_line(["teach", "roof", "--from", str(folder / "nothing.png")]) == BAD_INPUT


def test_the_same_with_other_objects_elsewhere(folder, capsys):
    out = folder / "out"
    like = [
        "--like",
        str(folder / "roof.yaml"),
        "--scene",
        str(folder / "roof.yaml"),
        "--model",
        "geometric",
        "--no-execute",
    ]
    assert command_line(["run", "the same, but at the back", *like, "--out", str(out), "--json"]) == DONE
    report = json.loads(capsys.readouterr().out)
    (part,) = report["parse"]["goal"]["parts"]
    assert (part["shape"], part["y_position"]) == (f"like {out / 'example.toml'}", "top") and report["verdict"][
        "success"
    ]
    assert command_line(["run", "the same", *like, "--parser", "llm"]) == USAGE
    assert "--like works only without a language model" in capsys.readouterr().err
