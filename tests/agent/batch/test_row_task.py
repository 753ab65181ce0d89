"""One row: a defect of our own is reported in its place, with its traceback beside it."""

import re
from dataclasses import replace

import pytest

from agent import events
from agent.batch.row_task import carry_out
from agent.batch.rows import Row
from agent.errors import BadInput
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from grounding.figures.files import write_figure
from grounding.figures.names import figure_named

ROW = Row(4, "mine", "stack the cans", RunOptions(seed=3), "00ff")


@pytest.mark.parametrize(
    ("error", "code", "step", "message"),
    [
        (ZeroDivisionError("by\nzero"), 1, "crash",
         "a defect of structagent, ZeroDivisionError: by zero, at agent/batch/row_task.py; see "
         "rows/mine/traceback.txt"),
        (BadInput("the disk is full"), 6, "report", "the disk is full"),
    ],
)  # fmt: skip
def test_an_error_that_ends_the_run(error, code, step, message, tmp_path, monkeypatch):
    def run(text, options, cache, on_step):
        yield events.Started(text, {})
        raise error

    monkeypatch.setattr("agent.batch.row_task.run_instruction", run)
    result = carry_out(ROW, tmp_path / "mine", ResourceCache())
    said = re.sub(r" line \d+", "", result["message"])
    assert (result["success"], result["exit_code"], result["step"], said) == (False, code, step, message)
    assert (result["id"], result["line"], result["seed"], result["fingerprint"]) == ("mine", 4, 3, "00ff")
    traceback = tmp_path / "mine" / "traceback.txt"
    assert traceback.exists() == (code == 1)
    if code == 1:
        assert "ZeroDivisionError" in traceback.read_text() and "test_row_task.py" in traceback.read_text()


def test_a_row_is_carried_out_with_the_figure_of_its_example(tmp_path, monkeypatch):
    write_figure(figure_named("gate"), tmp_path / "gate.toml")
    seen = []

    def run(text, options, cache, on_step):
        seen.append(options)
        yield events.Started(text, {})
        yield events.Finished(False, 4, 0.1)

    monkeypatch.setattr("agent.batch.row_task.run_instruction", run)
    row = replace(ROW, options=RunOptions(example=tmp_path / "gate.toml"))
    (tmp_path / "mine").mkdir()
    assert carry_out(row, tmp_path / "mine", ResourceCache())["exit_code"] == 4
    (options,) = seen
    assert figure_named(options.reading.like).blocks == figure_named("gate").blocks
    exact = carry_out(replace(row, options=replace(row.options, exact=True)), tmp_path / "mine", ResourceCache())
    assert (exact["step"], exact["exit_code"]) == ("example", 6) and "is a drawing without poses" in exact["message"]
