"""One scene there and back: what is measured on it, and what the tables make of rows."""

import io
import json
import os
import signal
from pathlib import Path

import numpy as np
import pytest

from agent.cli.app import command_line
from agent.errors import UsageError
from agent.evaluation import recordings
from agent.evaluation.recorded_masks import RecordingJob, overlaps_of
from agent.evaluation.recordings import _compare_runs, _rates, print_recordings
from agent.evaluation.report import report_by_structure, report_frame
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from agent.scenes.files import Problem, SceneFileError
from grounding.spec import StructureSpec
from structdiffusion.data.scene_sampling import draw_scene
from structdiffusion.objects.libraries import load_objects

LIBRARY = "procedural"
OPTIONS = RunOptions(objects=LIBRARY, model="geometric", execute=False)


def test_masks_are_compared_by_what_they_share():
    truth = {"a": np.zeros((4, 6), bool), "b": np.zeros((4, 6), bool)}
    truth["a"][:, :3], truth["b"][:2, 3:] = True, True
    labels = np.full((4, 6), -1)
    labels[:, 3:], labels[:2, :3] = 1, 2  # the first found holds all of b and as much again, the second half of a
    np.testing.assert_allclose(overlaps_of(truth, labels), [[0.0, 0.5], [0.5, 0.0]])
    assert overlaps_of(truth, np.full((4, 6), -1)).shape == (2, 0)


@pytest.fixture(scope="module")
def job() -> RecordingJob:
    library = load_objects(LIBRARY)
    blocks = [model for model in library if model.category in ("block", "can")]
    spec = StructureSpec("line", size="medium", x_position="left")
    return RecordingJob("line", 0, 5, draw_scene(blocks, spec, np.random.default_rng(2), count=3, distractors=0))


def test_a_planner_that_is_not_there_is_known_before_any_scene_is_drawn(monkeypatch):
    monkeypatch.setattr(recordings, "load_objects", None)
    with pytest.raises(UsageError, match="--model cannot be 'best'"):
        recordings.measure_recordings(LIBRARY, "best", None, 1, 0, False)


def test_a_scene_that_is_recorded_ends_as_it_does_in_simulation(job):
    row = _compare_runs(OPTIONS, ResourceCache(), job)
    assert row["found"] == 3 and row["exact"] and row["iou"] > 0.85
    assert row["simulated"] is None and row["recorded"] is None and row["same"]


def test_a_recording_that_cannot_be_used_is_a_row_of_its_own(job, monkeypatch):
    from agent.errors import BadInput

    class Refused:
        def __init__(self, path):
            raise BadInput("no table")

    monkeypatch.setattr(recordings, "RecordedSource", Refused)
    row = _compare_runs(OPTIONS, ResourceCache(), job)
    assert (row["found"], row["exact"], row["recorded"], row["same"]) == (0, False, "no table", False)


def test_a_hard_scene_that_no_scene_file_holds_is_drawn_again(monkeypatch):
    drawn = []

    def fall_once(options, cache, job):
        drawn.append(job.drawn)
        if len(drawn) == 1:
            raise SceneFileError(Path("scene.yaml"), [Problem(3, "'bit' does not stay where it is put")])
        return {"structure": job.structure}

    monkeypatch.setattr(recordings, "_compare_runs", fall_once)
    row = recordings._compare_hard_runs(OPTIONS, ResourceCache(), recordings._HardJob("line", 0, 3))
    assert row["structure"] == "line" and len(drawn) == 2 and drawn[0] != drawn[1]


def test_tables_count_rows():
    row = {"structure": "line", "exact": True, "iou": 0.9, "simulated": None, "recorded": None, "same": True}
    rows = [row | {"seconds": 1.0}, row | {"recorded": "fell", "same": False, "iou": 0.7, "seconds": 3.0}]
    report = report_by_structure(report_frame("structagent evaluate recordings", len(rows)), rows, _rates)
    every = report["aggregate"]["all"]
    assert every["same"]["count"] == 1 and every["iou"] == pytest.approx(0.8)
    told = io.StringIO()
    print_recordings(report, told)
    assert "0.800" in told.getvalue() and "structagent evaluate recordings" in told.getvalue()


def quick(options, loaded, job):
    """A scene that is recorded and built in no time."""
    row = {"structure": job.structure, "number": job.number, "seed": 0, "exact": True, "iou": 0.9}
    return row | {"simulated": None, "recorded": None, "same": True, "seconds": 1.0}


def quick_but_for_lines(options, loaded, job):
    if job.structure == "line":
        os.kill(os.getpid(), signal.SIGKILL)
    return quick(options, loaded, job)


def only_lines(options, loaded, job):
    if job.structure != "line":
        raise AssertionError("what is there is not recorded again")
    return quick(options, loaded, job)


def test_a_worker_that_dies_costs_its_scene_and_the_same_command_tries_it_again(objects, tmp_path, monkeypatch, capsys):
    out = tmp_path / "out"
    command = ["evaluate", "recordings", "--objects", objects, "--model", "geometric", "--scenes", "1"]
    command += ["--workers", "2", "--out", str(out)]
    monkeypatch.setattr(recordings, "_compare_runs", quick_but_for_lines)
    assert command_line(command) == 0
    table = capsys.readouterr().out
    assert "worker died" in table.splitlines()[0] and "1 scene is missing because a worker died" in table
    report = json.loads((out / "eval.json").read_text())
    lost = next(row for row in report["rows"] if row["structure"] == "line")
    assert lost["lost"] == "worker died (SIGKILL)"
    every = report["aggregate"]["all"]
    counts = [every[key]["count"] for key in ("exact", "simulated", "recorded", "same")]
    assert (every["n"], every["lost"], counts, every["iou"]) == (4, 1, [3, 3, 3, 3], pytest.approx(0.9))

    monkeypatch.setattr(recordings, "_compare_runs", only_lines)
    assert command_line(command) == 0
    assert "worker died" not in capsys.readouterr().out
    assert json.loads((out / "eval.json").read_text())["aggregate"]["all"]["same"]["count"] == 4
    assert command_line([*command, "--no-execute"]) == 2
    assert "holds an evaluation with --execute, not without --execute" in capsys.readouterr().err
