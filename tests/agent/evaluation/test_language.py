"""`structagent evaluate language`: what a sentence means, and what becomes of it as heard and as told."""

import io
import json
import os
from functools import partial

import numpy as np
import pytest
import trimesh

from agent.cli.app import command_line
from agent.evaluation import language
from agent.evaluation.benchmark_instructions import REFUSED, Instruction
from agent.evaluation.language import NOT_BUILT, _evaluate_instruction, _grouped, print_language
from grounding.benchmark import Row
from grounding.parse_result import Parse
from grounding.spec import SLOTS, StructureSpec
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.planners.factory import load_planner

MODELS = [procedural_object(kind, index) for kind in ("block", "can", "box") for index in range(3)]
OPEN = dict.fromkeys(SLOTS, (None,))
LEFT_LINE = StructureSpec("line", x_position="left", rotation="north")


def row_of(text="a line on the left", **acceptable):
    return Row(text, OPEN | acceptable, stratum="own")


def heard(spec, status="ok"):
    meant = row_of(shape=("line",), x_position=("left",), rotation=("north",))
    return Instruction(0, meant, LEFT_LINE, Parse(meant.text, spec, "told", status), *np.zeros((2, 384), np.float32))


@pytest.fixture(scope="module")
def carried_out():
    return partial(_evaluate_instruction, 20, 8, (MODELS, load_planner("geometric")))


def test_who_hears_wrong_builds_wrong_and_who_hears_right_is_not_asked_twice(carried_out):
    right = carried_out(heard(LEFT_LINE))
    assert right["exact"] and right["failure"] is right["failure_oracle"] is None and right["structure"] == "line"
    wrong = carried_out(heard(StructureSpec("line", x_position="right", rotation="north")))
    assert not wrong["exact"] and (wrong["failure"], wrong["failure_oracle"]) == ("semantic", None)
    assert wrong["objects"] == right["objects"] and wrong["draw"] == right["draw"]  # the same scene
    asked = carried_out(heard(LEFT_LINE, "ask"))
    assert (asked["failure"], asked["failure_oracle"], asked["exact"]) == (NOT_BUILT, None, False)

    report = {"aggregate": {key: _grouped([right, wrong, asked], key) for key in ("structure", "stratum")}}
    assert set(report["aggregate"]["structure"]) == {"line", "all"}
    found = report["aggregate"]["stratum"]["own"]
    counts = {
        key: found[key]["count"] for key in ("exact", "understood", "success", "success_oracle", "lost_by_parsing")
    }
    assert counts == {"exact": 1, "understood": 2, "success": 1, "success_oracle": 3, "lost_by_parsing": 2}
    assert found["failures"] == {"parsing": 2, "arrangement": 0} and found["won_by_parsing"]["count"] == 0
    told = io.StringIO()
    print_language(report | {"left_out": {REFUSED: 4}, "sentences": 7, "command": "again"}, told)
    assert "of 7 sentences left out: 4 must be refused" in told.getvalue() and "66.7" in told.getvalue()


def test_objects_that_make_no_such_structure(carried_out):
    setting = StructureSpec("table setting")
    row = row_of("set the table", shape=("table setting",))
    parse = Parse(row.text, setting, "told")
    row = carried_out(Instruction(0, row, setting, parse, np.zeros(384), np.zeros(384)))
    assert set(row) == {"number", "text", "ground_truth", "parsed", "status"}


@pytest.fixture
def arguments(tmp_path):
    """A command for two sentences, for one of which the objects do not do."""
    data, objects = tmp_path / "own.jsonl", tmp_path / "boxes"
    rows = [{"text": "make a line", "shape": ["line"]}, {"text": "set the table", "shape": ["table setting"]}]
    data.write_text("".join(json.dumps(row) + "\n" for row in rows))
    objects.mkdir()
    for number in range(3):
        trimesh.creation.box((0.05, 0.05, 0.05 + 0.01 * number)).export(objects / f"box_{number}.stl")
    words = ["evaluate", "language", "--data", str(data), "--objects", str(objects), "--model", "geometric"]
    return [*words, "--workers", "1", "--candidates", "4", "--json"]


@pytest.mark.usefixtures("in_this_process")
def test_from_the_command_line(arguments, capsys):
    assert command_line(arguments) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["sentences"] == 2 and report["left_out"]["no scene could be drawn"] == 1
    assert [row["text"] for row in report["rows"]] == ["make a line"] and report["rows"][0]["exact"]
    assert report["command"].startswith("structagent evaluate language --data /")
    assert command_line([*arguments, "--model", "oracle"]) == 2
    assert "'oracle'" in capsys.readouterr().err


@pytest.mark.usefixtures("in_this_process")
def test_a_folder_goes_on_where_it_was_stopped(arguments, tmp_path, capsys):
    out = tmp_path / "out"
    arguments += ["--out", str(out)]
    assert command_line([*arguments, "--limit", "1"]) == 0
    (first,) = json.loads(capsys.readouterr().out)["rows"]
    assert len((out / "rows.jsonl").read_text().splitlines()) == 1
    assert command_line(arguments) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["rows"] == [first] and report["left_out"]["no scene could be drawn"] == 1  # "seconds" are the same
    assert json.loads((out / "eval.json").read_text()) == report
    kept = (out / "rows.jsonl").read_text()
    assert len(kept.splitlines()) == 2
    assert command_line(arguments) == 0 and (out / "rows.jsonl").read_text() == kept
    capsys.readouterr()
    assert command_line([*arguments, "--as-said"]) == 2
    assert "holds an evaluation without --as-said, not with --as-said; choose another --out" in capsys.readouterr().err


@pytest.mark.usefixtures("in_this_process")
def test_a_sentence_that_has_changed_since_is_evaluate_instruction_again(arguments, tmp_path, capsys):
    arguments += ["--out", str(tmp_path / "out"), "--limit", "1"]
    assert command_line(arguments) == 0
    data = tmp_path / "own.jsonl"
    data.write_text(data.read_text().replace("make a line", "make a row"))
    capsys.readouterr()
    assert command_line(arguments) == 0
    assert [row["text"] for row in json.loads(capsys.readouterr().out)["rows"]] == ["make a row"]


def dies(seed, candidates, loaded, instruction):
    os._exit(9)


def test_a_worker_that_dies_costs_its_sentence_and_the_same_command_tries_it_again(
    arguments, tmp_path, monkeypatch, capsys
):
    arguments = [*arguments[:-1], "--limit", "1", "--out", str(tmp_path / "out")]
    with monkeypatch.context() as patched:
        patched.setattr(language, "_evaluate_instruction", dies)
        assert command_line(arguments) == 0
    table = capsys.readouterr().out
    assert [line.split()[-1] for line in table.splitlines()[:2]] == ["worker", "died"]
    assert "1 sentence is missing because a worker died" in table
    report = json.loads((tmp_path / "out" / "eval.json").read_text())
    (row,) = report["rows"]
    assert (row["text"], row["failure"], row["lost"]) == ("make a line", "worker died", "worker died (exit code 9)")
    found = report["aggregate"]["structure"]["all"]
    assert (found["n"], found["success"]["count"], found["lost"]) == (1, 0, 1)
    assert found["failures"] == {"parsing": 0, "arrangement": 0}
    assert command_line(arguments) == 0
    assert "worker died" not in capsys.readouterr().out
    report = json.loads((tmp_path / "out" / "eval.json").read_text())
    assert "lost" not in report["rows"][0] and report["aggregate"]["structure"]["all"]["lost"] == 0
