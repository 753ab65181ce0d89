"""`structagent run --disturb`: where there can be a disturbance, and how a run tells what happened."""

import io

import numpy as np
import pytest
from rich.console import Console

from agent import events
from agent.arm.disturbances import Disturbance
from agent.arm.events import Disturbed, Placed
from agent.cli.app import command_line
from agent.pipeline.run import RunOptions, run_instruction
from agent.reporting.event_schema import payload_error
from agent.reporting.event_text import arm_sentence
from agent.reporting.html.document import run_page
from agent.reporting.run_report import RunRecord
from agent.reporting.terminal_report import TerminalReport
from structdiffusion.objects.blocks import block_objects

WORDS = "put the cylinders in a line"


def run(text):
    """Carry out an instruction with a disturbance; return the events, and the report and text that tell of them."""
    options = RunOptions(objects="blocks", model="geometric", seed=2, hold="weld", disturb=Disturbance.parse(text))
    happened = list(run_instruction(WORDS, options))
    record, printed = RunRecord(), io.StringIO()
    screen = TerminalReport(Console(file=printed, width=300))
    for event in happened:
        record.on_event(event)
        screen.on_event(event)
    return happened, record, printed.getvalue()


@pytest.mark.usefixtures("quick_arm")
def test_a_run_tells_what_happened_everywhere():
    happened, record, text = run("push@1")
    (told,) = [event for event in happened if isinstance(event, Disturbed)]
    assert payload_error(told.to_dict()) is None and told.detail.startswith("was pushed by ")
    assert sum(isinstance(event, Placed) for event in happened[: happened.index(told)]) == 1
    said = f"disturbed on purpose (push): {told.name} {told.detail}"
    assert arm_sentence(told.to_dict(), []) == said and said in text and said in run_page(record.turn)
    assert told.to_dict() in record.report["arm"] and record.report["options"]["disturb"] == {"kind": "push", "at": 1}
    pictured = happened[happened.index(told) + 1]
    assert isinstance(pictured, events.Pictured) and told.detail in pictured.caption
    motion = pictured.motions[told.name]
    assert 0.028 < np.linalg.norm(motion[:2, 3]) < 0.5  # it may have been placed before
    (film,) = [event for event in happened if isinstance(event, events.Filmed)]
    assert told.name in film.motions


@pytest.mark.usefixtures("quick_arm")
def test_what_is_added_is_on_the_table_and_on_film():
    happened, _, _ = run("add")
    (told,) = [event for event in happened if isinstance(event, Disturbed)]
    assert told.object is None and told.name.startswith("new ") and "is to go" in told.detail
    (film,) = [event for event in happened if isinstance(event, events.Filmed)]
    ways = film.motions[told.name]
    assert np.abs(ways[0] - np.eye(4)).max() < 1e-6 and ways[-1][2, 3] > 10.0  # it came from out of sight
    after = [event for event in happened if isinstance(event, events.Pictured)][-1]
    assert after.motions[told.name][2, 3] > 10.0


@pytest.mark.usefixtures("quick_arm")
def test_what_does_not_happen_is_said():
    happened, record, text = run("remove@90")
    (noted,) = [event for event in happened if isinstance(event, events.Noted) and "disturbance" in event.message]
    assert noted.message.startswith("the disturbance remove@90 did not happen: there were only ")
    assert noted.message in text and not any(isinstance(event, Disturbed) for event in happened)


@pytest.mark.parametrize(
    "options, said",
    [
        (["--disturb", "pull"], "legal values: push, remove, add, drop, topple, swap"),
        (["--disturb", "push", "--scene", "example"], "--disturb push is for simulated scenes"),
        (["--disturb", "drop@2", "--scene", "table.bag"], "--disturb drop@2 is for simulated scenes"),
        (["--disturb", "swap", "--no-execute"], "--disturb swap needs the arm"),
    ],
)
def test_what_cannot_be_disturbed_is_refused_in_a_sentence(options, said, tmp_path, capsys):
    assert command_line(["run", WORDS, "--out", str(tmp_path / "out"), *options]) == 2
    error = capsys.readouterr().err
    assert said in error and len(error.strip().splitlines()) == 1 and not (tmp_path / "out").exists()


def test_a_run_from_python_is_refused_too():
    *_, failed, finished = run_instruction("a line", RunOptions("example", disturb=Disturbance("push")))
    assert failed.exit_code == finished.exit_code == 2 and "simulated scenes" in failed.message


def test_a_spare_object_is_nowhere_on_the_table(table):
    before, seen = table.names, [cloud.name for cloud in table.look().objects]
    names = ["new block", "another new block"]
    assert [table.keep_away(model) for model in block_objects()[:2]] == [2, 3] and table.names == (*before, *names)
    assert set(names) <= set(table.fallen) and [cloud.name for cloud in table.look().objects] == seen
    assert len(table.poses()) == len(table.models) == len(table.referents) == len(table.world_from_initial) == 4
    assert table.film_camera.picture(table.film_camera.moment()).shape[2] == 3
