"""The measurement of the arm on one real scene: plan, physics and verdict."""

import json
import os
from functools import partial

import pytest

from agent.arm.kinematics import Kinematics
from agent.cli.app import command_line
from agent.evaluation import arm
from agent.evaluation.arm import _build_scene, _rates
from agent.evaluation.scenes import with_sentences
from grounding.spec import FIRST_SHAPES
from structdiffusion.benchmark.scenes import draw_evaluation_scenes
from structdiffusion.objects.libraries import load_objects
from structdiffusion.planners.geometric import GeometricPlanner


@pytest.mark.usefixtures("quick_arm")
def test_a_scene_is_built_and_judged():
    models = [model for model in load_objects("ycb") if model.category in ("cup", "can")]
    scenes = with_sentences(list(draw_evaluation_scenes(models, 1, shapes=("line",), seed=2)), parsed=False)
    row = partial(_build_scene, 8, "weld", Kinematics())(GeometricPlanner(), scenes[0])
    assert row["structure"] == "line" and row["words"]
    # Whatever the arm achieves, the row may not claim more than happened.
    assert row["planned"] or row["trouble"]
    assert row["placed"] <= len(row["objects"])
    assert not row["stands"] or (row["planned"] and row["placed"] == len(row["objects"]) and not row["failed_checks"])
    assert _rates([row])["stands"]["count"] == int(row["stands"])


def quick(candidates, hold, kinematics, planner, scene):
    """A scene that is built in no time."""
    about = {"structure": scene.structure, "number": scene.number, "seed": scene.seed}
    return about | {"planned": True, "stands": scene.structure != "tower", "seconds": 2.0}


def quick_but_for_lines(candidates, hold, kinematics, planner, scene):
    """Takes its worker along where a line is to be built."""
    if scene.structure == "line":
        os._exit(9)
    return quick(candidates, hold, kinematics, planner, scene)


def only_lines(candidates, hold, kinematics, planner, scene):
    if scene.structure != "line":
        raise AssertionError("what is there is not built again")
    return quick(candidates, hold, kinematics, planner, scene)


def test_a_worker_that_dies_costs_its_scene_and_the_same_command_tries_it_again(objects, tmp_path, monkeypatch, capsys):
    out = tmp_path / "out"
    command = ["evaluate", "arm", "--objects", objects, "--model", "geometric", "--scenes", "1", "--seed", "3"]
    command += ["--workers", "2", "--out", str(out)]
    monkeypatch.setattr(arm, "_build_scene", quick_but_for_lines)
    assert command_line(command) == 0
    table = capsys.readouterr().out
    assert "worker died" in table.splitlines()[0] and "1 scene is missing because a worker died" in table
    report = json.loads((out / "eval.json").read_text())
    rows = {row["structure"]: row for row in report["rows"]}
    assert list(rows) == ["circle", "line", "tower", "table setting"]
    assert rows["line"] == {"structure": "line", "number": 0, "seed": 3, "lost": "worker died (exit code 9)"}
    every = report["aggregate"]["all"]
    assert (every["n"], every["lost"], every["planned"]["count"], every["stands"]["count"]) == (4, 1, 3, 2)
    assert every["seconds"] == 2.0 and report["aggregate"]["line"]["seconds"] is None

    monkeypatch.setattr(arm, "_build_scene", only_lines)
    assert command_line(command) == 0
    assert "worker died" not in capsys.readouterr().out
    again = json.loads((out / "eval.json").read_text())
    assert again["aggregate"]["all"]["planned"]["count"] == 4 and again["aggregate"]["all"]["lost"] == 0
    assert [row for row in again["rows"] if row["structure"] != "line"] == [
        row for row in report["rows"] if row["structure"] != "line"
    ]
    assert command_line([*command, "--seed", "4"]) == 2
    assert "holds an evaluation with --seed 3, not with --seed 4" in capsys.readouterr().err


@pytest.mark.usefixtures("in_this_process")
def test_one_structure_of_so_many_objects(objects, capsys, monkeypatch):
    counts = []

    def counted(candidates, hold, kinematics, planner, scene):
        counts.append(scene.drawn.count)
        return quick(candidates, hold, kinematics, planner, scene)

    monkeypatch.setattr(arm, "_build_scene", counted)
    asked = ["evaluate", "arm", "--objects", objects, "--model", "geometric", "--structure", "line", "--scenes", "2"]
    assert command_line([*asked, "--objects-per-scene", "3", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert counts == [3, 3] and list(report["aggregate"]) == ["line", "all"]
    assert "--structure line --candidates 64 --objects-per-scene 3" in report["command"]


def test_it_goes_on_where_it_was_killed(objects, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(arm, "_build_scene", quick)
    options = arm.ArmConfig(objects, seed=3, candidates=8, model="geometric"), FIRST_SHAPES, 1
    report = arm.measure_arm(*options, workers=0, out=tmp_path / "out")
    journal = tmp_path / "out" / "rows.jsonl"
    content = journal.read_bytes()
    journal.write_bytes(content[: content.rstrip(b"\n").rindex(b"\n") + 30])  # killed while it wrote the last row
    capsys.readouterr()
    assert arm.measure_arm(*options, workers=0, out=tmp_path / "out") == report
    assert "1 of 1 scenes drawn" in capsys.readouterr().err
