"""An evaluation of success on a few boxes: the same rows however they come, and a folder that goes on."""

import contextlib
import io
import json
import os
import shutil
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from PIL import Image

from agent.cli.app import command_line
from agent.errors import BadInput, UsageError
from agent.evaluation.success import measure
from agent.evaluation.success.config import SuccessConfig
from agent.evaluation.success.measure import measure_success
from agent.evaluation.success.report import print_success, write_success
from agent.pipeline.resources import ResourceCache
from agent.runtime.output_ownership import mark
from grounding.atomic_files import opened
from grounding.spec import SHAPES
from structdiffusion.observation import Arrangement
from structdiffusion.simulation.world import TabletopWorld

MODELS, STRUCTURES = ["geometric"], ["line", "tower"]


@pytest.fixture(scope="module")
def objects(tmp_path_factory):
    """A folder of four boxes."""
    folder = tmp_path_factory.mktemp("boxes")
    for number in range(4):
        trimesh.creation.box((0.05, 0.05 + 0.01 * number, 0.04 + 0.01 * number)).export(folder / f"box_{number}.stl")
    return folder


@pytest.fixture(scope="module")
def config(objects):
    return SuccessConfig(str(objects), seed=20, candidates=4, top_k=3)


@pytest.fixture(scope="module")
def first(config, tmp_path_factory):
    """A finished folder, its report, and what was said on the way."""
    out = tmp_path_factory.mktemp("evaluation") / "out"
    with contextlib.redirect_stderr(io.StringIO()) as said:
        report = measure_success(config, MODELS, STRUCTURES, 2, workers=0, out=out)
    return out, report, said.getvalue()


@pytest.fixture
def finished(first, tmp_path):
    """A copy of the finished folder."""
    return shutil.copytree(first[0], tmp_path / "out")


def timeless(report):
    """The rows without the times."""
    text = json.dumps([evaluation["scenes"] for evaluation in report["evaluations"]])
    return json.loads(text, object_hook=lambda row: {k: v for k, v in row.items() if not k.endswith("seconds")})


def test_the_report_has_a_row_for_every_scene(first, config):
    out, report, said = first
    (evaluation,) = report["evaluations"]
    rows = evaluation["scenes"]
    assert [(row["structure"], row["number"]) for row in rows] == [(s, n) for s in ("line", "tower") for n in (0, 1)]
    assert all(row["model"] == "geometric" and row["seed"] == 20 and row["proposed"] == 4 for row in rows)
    assert all(row["words"] and row["parsed"] is None for row in rows)  # no instruction is parsed for these models
    assert evaluation["aggregate"]["all"]["n"] == 4 and evaluation["about"]["candidates"] == 4
    assert report["resources"]["rows"] == 4 and evaluation["aggregate"]["all"]["seconds_total"] > 0
    assert len((out / "rows.jsonl").read_text().splitlines()) == 4
    structures = "--structure line --structure tower"
    assert report["command"].endswith(f"--scenes 2 --seed 20 --model geometric {structures} --candidates 4 --top-k 3")
    assert "4 of 4 scenes drawn in " in said and "4 of 4 rows in " in said  # no terminal, and yet not nothing


def test_the_rows_are_the_same_with_more_workers(config):
    models = ["geometric", "geometric+rollout"]  # on one scene: two rows, and only those need workers to be started
    alone, together = (measure_success(config, models, ["line"], 1, workers=workers) for workers in (0, 2))
    assert (alone["resources"]["workers"], together["resources"]["workers"]) == (0, 2)
    assert timeless(together) == timeless(alone) and together["command"] == alone["command"]


def test_the_rows_are_the_same_on_ray(first, config):
    report = measure_success(config, MODELS, ["line"], 1, workers=1, ray="local")
    assert report["resources"]["ray"] and timeless(report)[0] == timeless(first[1])[0][:1]


def test_what_is_there_is_not_computed_again(first, config, finished, monkeypatch):
    journal = finished / "rows.jsonl"
    content = journal.read_bytes()
    journal.write_bytes(content[: content.rstrip(b"\n").rindex(b"\n") + 30])  # killed while it wrote the last row
    monkeypatch.setattr("structdiffusion.benchmark.scenes._MAX_DRAWS", 0)  # no scene is drawn anew
    report = measure_success(config, MODELS, STRUCTURES, 2, workers=0, out=finished)
    assert report["resources"]["rows"] == 1 and timeless(report) == timeless(first[1])
    again = measure_success(config, MODELS, STRUCTURES, 2, workers=0, out=finished)
    assert again["resources"]["rows"] == 0 and again["evaluations"] == report["evaluations"]


def test_models_and_scenes_are_added(first, config, finished):
    more = measure_success(config, ["geometric+rollout"], ["line"], 1, workers=0, out=finished)
    assert [evaluation["about"]["model"] for evaluation in more["evaluations"]] == ["geometric", "geometric+rollout"]
    assert more["resources"]["rows"] == 1 and timeless(more)[0] == timeless(first[1])[0]
    report = measure_success(config, MODELS, ["tower"], 3, workers=0, out=finished)
    assert report["resources"]["rows"] == 1 and "--scenes 3" in report["command"]
    assert [len(evaluation["scenes"]) for evaluation in report["evaluations"]] == [5, 1]


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"seed": 21}, "with --seed 20, not with --seed 21"),
        ({"candidates": 5}, "with --candidates 4, not with --candidates 5"),
        ({"top_k": 1}, "with --top-k 3, not with --top-k 1"),
        ({"objects_per_scene": "3"}, "without --objects-per-scene, not with --objects-per-scene 3"),
        ({"camera": "left"}, "with --camera robot, not with --camera left"),
    ],
)
def test_another_command_is_refused(config, finished, changed, said):
    with pytest.raises(UsageError, match=f"holds an evaluation {said}; choose another --out"):
        measure_success(replace(config, **changed), MODELS, STRUCTURES, 2, workers=0, out=finished)


def test_other_objects_of_the_same_name_are_refused(tmp_path):
    objects = tmp_path / "boxes"
    objects.mkdir()
    for number in range(3):
        trimesh.creation.box((0.05, 0.05, 0.05)).export(objects / f"box_{number}.stl")
    config, out = SuccessConfig(str(objects), candidates=1, top_k=1), tmp_path / "out"
    measure_success(config, MODELS, ["line"], 1, workers=0, out=out)
    trimesh.creation.box((0.05, 0.05, 0.06)).export(objects / "box_0.stl")
    with pytest.raises(UsageError, match="with other objects of that name, which have changed since"):
        measure_success(config, MODELS, ["line"], 1, workers=0, out=out)


def test_rows_of_other_code_are_refused(config, finished, monkeypatch):
    monkeypatch.setattr("agent.evaluation.result_store.checksum_of_code", lambda *packages: "other")
    with pytest.raises(UsageError, match="holds an evaluation by other code, and rows of both cannot be mixed"):
        measure_success(config, MODELS, STRUCTURES, 2, workers=0, out=finished)


def test_networks_may_be_added_and_those_in_use_not_changed(config, tmp_path, monkeypatch):
    weights, out, used = tmp_path / "weights", tmp_path / "out", []
    # A geometric planner needs none
    monkeypatch.setattr("agent.evaluation.result_store.networks_of", lambda model: used)
    config = replace(config, weights=weights, candidates=1, top_k=1)
    for name in ("one", "two"):
        used.append(name)
        (weights / name).mkdir(parents=True)
        (weights / name / "model.safetensors").write_bytes(name.encode())
        report = measure_success(config, MODELS, ["line"], 1, workers=0, out=out)
    assert report["resources"]["rows"] == 0
    (weights / "one" / "model.safetensors").write_bytes(b"three")
    with pytest.raises(UsageError, match="other weights of the network 'one', which have changed since"):
        measure_success(config, MODELS, ["line"], 1, workers=0, out=out)
    used.remove("one")
    assert measure_success(config, MODELS, ["line"], 1, workers=0, out=out)["resources"]["rows"] == 0


def test_a_folder_of_something_else_is_left_alone(config, tmp_path):
    (tmp_path / "rows.jsonl").write_text('{"id": 1}\n')
    with pytest.raises(UsageError, match="holds files that structagent did not write as the output of an evaluation"):
        measure_success(config, MODELS, STRUCTURES, 1, workers=0, out=tmp_path)
    with opened(tmp_path) as place:
        mark(place, "evaluation", ("rows.jsonl",))
    with pytest.raises(BadInput, match="has rows.jsonl but no about.json; choose another --out"):
        measure_success(config, MODELS, STRUCTURES, 1, workers=0, out=tmp_path)
    (tmp_path / "about.json").write_text("[]")
    with pytest.raises(BadInput, match="about.json' is not that of an evaluation"):
        measure_success(config, MODELS, STRUCTURES, 1, workers=0, out=tmp_path)


@pytest.mark.parametrize(
    ("model", "asked_for"),
    [("diffusion", 64), ("cvae+cem-unranked", 64), ("diffusion-unranked", 5), ("diffusion-tokens-best16", 16)],
)
def test_who_does_not_choose_proposes_no_more_than_is_tried(model, asked_for):
    assert SuccessConfig("ycb").candidates_of(model) == asked_for


class _Failing:
    """Proposes that everything stays where it is, but 3 cm deeper in the table."""

    def propose(self, scene, goal, *, count, generator):
        motions = np.tile(np.eye(4), (len(scene.objects), 1, 1))
        motions[:, 2, 3] = -0.03
        return [Arrangement(motions)]


def test_failures_are_pictured(config, tmp_path, monkeypatch):
    monkeypatch.setattr(ResourceCache, "planner", lambda *_: _Failing())
    out = tmp_path / "out"
    for most in (0, 3, 3):
        report = measure_success(config, MODELS, STRUCTURES, 2, workers=0, out=out, pictures=most)
    (evaluation,) = report["evaluations"]
    assert evaluation["aggregate"]["all"]["failures"]["intersection"]["count"] == 4
    names = sorted(path.name for path in (out / "failures").iterdir())
    assert names == [f"geometric_intersection_{scene}.png" for scene in ("line-000", "line-001", "tower-000")]
    for name in names:
        with Image.open(out / "failures" / name) as picture:
            pixels = np.asarray(picture)
        assert pixels.shape[1] > 800 and pixels.shape[0] > 440
        assert (pixels[400:].max(axis=2) < 100).sum() > 500  # the caption
    with pytest.MonkeyPatch.context() as patch:  # what is there is not drawn again
        patch.setattr(TabletopWorld, "picture", None)
        measure_success(config, MODELS, STRUCTURES, 2, workers=0, out=out, pictures=3)


@pytest.mark.usefixtures("in_this_process")
def test_the_command(objects, tmp_path, capsys):
    out = tmp_path / "out"
    line = ["evaluate", "success", "--objects", str(objects), "--model", "geometric", "--structure", "tower"]
    line += ["--scenes", "1", "--seed", "20", "--candidates", "2", "--workers", "1"]
    assert command_line([*line, "--out", str(out), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert json.loads((out / "eval.json").read_text()) == report
    assert report["evaluations"][0]["aggregate"]["tower"]["n"] == 1
    assert "| geometric | 1 |" in (out / "tables.md").read_text()
    for name in ("success_at_k.png", "failures.png"):
        with Image.open(out / name) as picture:
            assert picture.width > 400
    assert command_line([*line, "--out", str(out)]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[0].split()[:4] == ["model", "structure", "n", "success"] and told[-1] == report["command"]


@pytest.mark.parametrize(
    ("option", "said"),
    [
        (("--structure", "heart"), f"--structure cannot be 'heart'; legal values: {', '.join(SHAPES)}"),
        (("--camera", "below"), "--camera cannot be 'below'"),
        (("--model", "best"), "--model cannot be 'best'"),
        (("--ray", "here"), "--ray cannot be 'here'"),
        (("--top-k", "100", "--candidates", "3"), "--top-k cannot be 100 with --candidates 3; legal: 1 to 3"),
    ],
)
def test_options_that_are_not_legal(objects, option, said, capsys):
    assert command_line(["evaluate", "success", "--objects", str(objects), "--model", "geometric", *option]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("name", ["about.json", "rows.jsonl", "eval.json"])
def test_a_folder_in_place_of_a_file(objects, tmp_path, capsys, name):
    with opened(tmp_path) as place:
        mark(place, "evaluation", ())
    (tmp_path / name).mkdir()
    command = ["evaluate", "success", "--objects", str(objects), "--model", "geometric", "--out", str(tmp_path)]
    assert command_line(command) == 6
    assert f"'{tmp_path}/{name}' is a folder, and must be a file; choose another --out" in capsys.readouterr().err


def test_a_file_in_place_of_the_folder_of_pictures(config, tmp_path):
    (tmp_path / "failures").touch()
    with pytest.raises(BadInput, match="failures' is a file, and must be a folder; choose another --out"):
        measure_success(config, MODELS, STRUCTURES, 1, workers=0, out=tmp_path)


def row_but_for_the_first_line(config, loaded, job):
    name, scene = job
    if (scene.structure, scene.number) == ("line", 0):
        os._exit(9)
    return measure._solve_scene(config, loaded, job)


def drawn_but_for_towers(seed, conditions, library, job):
    if job[0][0] == "tower":
        os._exit(9)
    return measure._draw_scene(seed, conditions, library, job)


def test_a_worker_that_dies_costs_its_row_and_the_same_command_tries_it_again(first, config, tmp_path, monkeypatch):
    out = tmp_path / "out"
    with monkeypatch.context() as patched:
        patched.setattr("agent.evaluation.success.measure._solve_scene", row_but_for_the_first_line)
        patched.setattr("agent.evaluation.success.measure._draw_scene", drawn_but_for_towers)
        report = measure_success(config, MODELS, STRUCTURES, 2, workers=2, out=out)
    (evaluation,) = report["evaluations"]
    rows = {(row["structure"], row["number"]): row for row in evaluation["scenes"]}
    assert list(rows) == [("line", 0), ("line", 1), ("tower", 0), ("tower", 1)]
    lost = [place for place, row in rows.items() if row["failure"] == "worker died"]
    assert lost == [("line", 0), ("tower", 0), ("tower", 1)]
    assert all(rows[place]["problem"] == "worker died (exit code 9)" for place in lost)
    every = evaluation["aggregate"]["all"]
    assert (every["n"], every["lost"]["count"]) == (4, 3)
    assert every["plan_seconds"] == pytest.approx(rows["line", 1]["plan_seconds"])
    table = io.StringIO()
    print_success(report, table)
    assert [line.split()[-1] for line in table.getvalue().splitlines()[:2]] == ["worker", "died"]
    assert "3 rows are missing" in table.getvalue()
    assert all(path.is_file() for path in write_success(report, out))
    assert "| worker died |" in (out / "tables.md").read_text()

    again = measure_success(config, MODELS, STRUCTURES, 2, workers=0, out=out)
    assert again["resources"]["rows"] == 3 and timeless(again) == timeless(first[1])
    table = io.StringIO()
    print_success(again, table)
    assert "worker died" not in table.getvalue()
