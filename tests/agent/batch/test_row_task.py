"""One row: a defect of our own is reported in its place, with its traceback beside it."""

import re

import pytest

from agent import events
from agent.batch.row_task import carry_out
from agent.batch.rows import Row
from agent.errors import BadInput
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions

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
    def run(text, options, cache):
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
