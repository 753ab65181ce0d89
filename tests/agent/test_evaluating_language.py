"""`structagent evaluate language`: what a sentence means, and what becomes of it as heard and as told."""

import io
import json
from functools import partial

import numpy as np
import pytest
import trimesh

from agent.cli import command_line
from agent.evaluating_language import (
    NO_WISH,
    NOT_BUILT,
    REFUSED,
    Instruction,
    _carried_out,
    _grouped,
    meaning,
    tell_language,
    understood,
)
from agent.reading import ReadingOptions
from grounding.benchmark import Row
from grounding.parse import Parse
from grounding.spec import SLOTS, StructureSpec
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.sampling import load_planner

MODELS = [procedural_object(kind, index) for kind in ("block", "can", "box") for index in range(3)]
OPEN = {slot: (None,) for slot in SLOTS}
LEFT_LINE = StructureSpec("line", x_position="left", rotation="north")


def row_of(text="a line on the left", **acceptable):
    return Row(text, OPEN | acceptable, stratum="own")


def heard(spec, status="ok"):
    meant = row_of(shape=("line",), x_position=("left",), rotation=("north",))
    return Instruction(0, meant, LEFT_LINE, Parse(meant.text, spec, "told", status), *np.zeros((2, 384), np.float32))


def test_of_several_readings_the_one_that_was_heard_is_meant():
    row = row_of(shape=("circle", None), size=("small",), rotation=(None, "south"))
    assert meaning(row, None) == meaning(row, StructureSpec("line", "large")) == StructureSpec("circle", "small")
    other = StructureSpec(None, "large", rotation="south")
    assert meaning(row, other) == StructureSpec(None, "small", rotation="south")
    # A tower has no size: what was heard does not go with the rest, so the best values count.
    small = row_of(shape=("line", "tower"), size=("small",))
    assert meaning(small, StructureSpec("tower")) == StructureSpec("line", "small")
    assert meaning(row_of(shape=("tower",), size=("small",)), None) is None


def test_what_asks_for_no_structure_is_left_out_and_counted():
    rows = [
        row_of("put the cans in a circle on the left", shape=("circle",), x_position=("left",)),
        Row("what time is it", OPEN, refuse=True),
        row_of("arrange the things"),
        row_of("a small tower", shape=("tower",), size=("small",)),
    ]
    found, left_out = understood(list(enumerate(rows, start=7)), ReadingOptions())
    assert left_out == {REFUSED: 1, NO_WISH: 2}
    (instruction,) = found
    assert (instruction.number, instruction.understood) == (7, True)
    assert instruction.parse.spec == instruction.meant == StructureSpec("circle", x_position="left")
    assert instruction.embedding.shape == (384,)
    # What was heard right is said as the slots are, in other words than the instruction; or else as it was said.
    np.testing.assert_array_equal(instruction.embedding_heard, instruction.embedding)
    ((as_said,), _) = understood(list(enumerate(rows, start=7)), ReadingOptions(), as_said=True)
    np.testing.assert_array_equal(as_said.embedding_heard, as_said.embedding)
    assert 0.3 < instruction.embedding @ as_said.embedding < 0.999


@pytest.fixture(scope="module")
def carried_out():
    return partial(_carried_out, 20, 8, (MODELS, load_planner("geometric")))


def test_who_hears_wrong_builds_wrong_and_who_hears_right_is_not_asked_twice(carried_out):
    right = carried_out(heard(LEFT_LINE))
    assert right["exact"] and right["failure"] is right["failure_told"] is None and right["structure"] == "line"
    wrong = carried_out(heard(StructureSpec("line", x_position="right", rotation="north")))
    assert not wrong["exact"] and (wrong["failure"], wrong["failure_told"]) == ("semantic", None)
    assert wrong["objects"] == right["objects"] and wrong["draw"] == right["draw"]  # the same scene
    asked = carried_out(heard(LEFT_LINE, "ask"))
    assert (asked["failure"], asked["failure_told"], asked["exact"]) == (NOT_BUILT, None, False)

    report = {"aggregate": {key: _grouped([right, wrong, asked], key) for key in ("structure", "stratum")}}
    assert set(report["aggregate"]["structure"]) == {"line", "all"}
    found = report["aggregate"]["stratum"]["own"]
    counts = {key: found[key]["count"] for key in ("exact", "understood", "success", "success_told", "lost_by_parsing")}
    assert counts == {"exact": 1, "understood": 2, "success": 1, "success_told": 3, "lost_by_parsing": 2}
    assert found["failures"] == {"parsing": 2, "arrangement": 0} and found["won_by_parsing"]["count"] == 0
    told = io.StringIO()
    tell_language(report | {"left_out": {REFUSED: 4}, "sentences": 7, "command": "again"}, told)
    assert "of 7 sentences left out: 4 must be refused" in told.getvalue() and "66.7" in told.getvalue()


def test_objects_that_make_no_such_structure_give_no_row(carried_out):
    setting = StructureSpec("table setting")
    row = row_of("set the table", shape=("table setting",))
    parse = Parse(row.text, setting, "told")
    assert carried_out(Instruction(0, row, setting, parse, np.zeros(384), np.zeros(384))) is None


def test_from_the_command_line(tmp_path, capsys):
    data = tmp_path / "own.jsonl"
    rows = [{"text": "make a line", "shape": ["line"]}, {"text": "set the table", "shape": ["table setting"]}]
    data.write_text("".join(json.dumps(row) + "\n" for row in rows))
    for number in range(3):
        trimesh.creation.box((0.05, 0.05, 0.05 + 0.01 * number)).export(tmp_path / f"box_{number}.stl")
    arguments = ["evaluate", "language", "--data", str(data), "--objects", str(tmp_path), "--model", "geometric"]
    assert command_line([*arguments, "--workers", "1", "--candidates", "4", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["sentences"] == 2 and report["left_out"]["no scene could be drawn"] == 1
    assert [row["text"] for row in report["rows"]] == ["make a line"] and report["rows"][0]["exact"]
    assert report["command"].startswith(f"structagent evaluate language --data {data}")
    assert command_line([*arguments, "--model", "oracle"]) == 2
    assert "'oracle'" in capsys.readouterr().err
