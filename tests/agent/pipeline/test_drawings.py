"""Runs with a language model that draws: nothing is built that no person accepts, and the drawing is what stands."""

import sys

import pytest

from agent import events
from agent.cli.app import command_line
from agent.errors import DONE, NOT_BUILDABLE
from agent.figures.examples import read_example
from agent.pipeline.instruction_parser import ReadingOptions
from agent.pipeline.run import RunOptions, run_instruction
from grounding.figures.names import figure_named
from tests.agent.chat.conftest import DESK
from tests.grounding.language_model.artist import HOOK, Artist, build, drawn
from tests.grounding.language_model.oracle import MODEL, serving_oracle

TEXT = "lay out a hook with the cups and box 2"
BLOCKS = "build a cactus with the blocks"
CACTUS = {"blocks": [{"x": x, "level": level, "width": 1} for x, level in ((0, 0), (1, 0), (0, 1), (0, 2))]}
SCRIPT = {
    TEXT: build(drawn("hook", HOOK, objects=[0, 1, 2, 4])),
    BLOCKS: build(drawn("cactus", CACTUS, objects=["the blocks"])),
}


@pytest.fixture
def artist():
    with serving_oracle(Artist(SCRIPT)) as artist:
        yield artist


@pytest.fixture
def run(artist):
    """The events of a run that stops at the goal and tries it in physics."""

    def events_of(text=TEXT, scene=str(DESK), accept=False, on_drawing=None):
        reading = ReadingOptions("llm", llm_url=artist.url, llm_model=MODEL, accept_drawings=accept)
        options = RunOptions(scene, "procedural", "geometric", seed=1, execute=False, reading=reading)
        return list(run_instruction(text, options, on_drawing=on_drawing))

    return events_of


def test_nothing_is_built_that_nobody_accepts(run):
    for decide in (None, lambda drawn: False):
        found = run(on_drawing=decide)
        (failed,) = [one for one in found if isinstance(one, events.Failed)]
        assert failed.exit_code == NOT_BUILDABLE and failed.step == "parse"
        assert failed.message.startswith(
            "no figure is called 'hook', and the language model's drawing of it was not accepted"
        )
        assert "--accept-drawings" in failed.message and "structagent teach" in failed.message
        assert not any(isinstance(one, events.Proposed) for one in found)


def test_a_drawing_that_is_accepted_stands_as_it_was_drawn(run):
    shown = []
    found = run(on_drawing=lambda drawn: not shown.extend(drawn))
    assert [figure.nouns for figure in shown] == [("hook",)]
    (checked,) = [one for one in found if isinstance(one, events.Checked)]
    assert checked.success and checked.checks and all(check.passed for check in checked.checks)
    assert "outline off the drawing (share of its width)" in {check.name for check in checked.checks}
    assert found[-1].exit_code == DONE
    notes = [one.message for one in found if isinstance(one, events.Noted)]
    assert any("'hook' is built as the language model drew it" in note for note in notes)


def test_an_upright_drawing_stands_on_a_drawn_table_with_the_objects_that_were_named(run):
    found = run(BLOCKS, "simulated", accept=True)
    (checked,) = [one for one in found if isinstance(one, events.Checked)]
    assert checked.success and all(check.passed for check in checked.checks)
    assert {"objects in the cactus", "objects that rest on others than drawn"} <= {one.name for one in checked.checks}
    (chosen,) = [one for one in found if isinstance(one, events.Chosen)]
    assert [goal["name"].split()[0] for goal in chosen.goals if not goal.get("aside")] == ["block"] * 4


def test_the_command_shows_the_drawing_and_takes_it_with_an_option(artist, tmp_path, capsys, monkeypatch):
    command = [
        "run", TEXT, "--scene", str(DESK), "--model", "geometric", "--no-execute", "--parser", "llm",
        "--llm-url", artist.url, "--llm-model", MODEL, "--out",
    ]  # fmt: skip
    assert command_line([*command, str(tmp_path / "refused")]) == NOT_BUILDABLE
    told = capsys.readouterr().err
    assert (
        "the language model drew this, of 4 or more objects, for 'hook':\no\n" in told and "--accept-drawings" in told
    )
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    monkeypatch.setattr(sys.stdin, "readline", lambda: "no\n", raising=False)
    assert command_line([*command, str(tmp_path / "declined")]) == NOT_BUILDABLE
    assert "build it? [y/n]" in capsys.readouterr().err
    assert command_line([*command, str(tmp_path / "built"), "--accept-drawings"]) == DONE
    captured = capsys.readouterr()
    assert "shape       hook\n" in captured.out and "strokes" not in captured.out.replace("strokes that differ", "")
    taught = read_example(tmp_path / "built", "my hook")
    assert [list(map(list, stroke)) for stroke in taught.strokes] == HOOK["strokes"]
    assert figure_named("letter L").strokes != taught.strokes
