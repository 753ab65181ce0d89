"""The measurement of completion: on the true bodies it is perfect, and on one real scene it says what happened."""

import io
import json
import os
import sys
from functools import partial

import numpy as np
import pytest

from agent.cli.app import command_line
from agent.evaluation import completion
from agent.evaluation.completion import _compare_methods, _rates, _Truth, print_completion
from structdiffusion.benchmark.scenes import draw_evaluation_scenes
from structdiffusion.completion.methods import METHODS
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.procedural import procedural_objects


@pytest.fixture(scope="module")
def row():
    models = [model for model in load_objects("ycb") if model.category in ("can", "box", "bottle")]
    (scene,) = draw_evaluation_scenes(models, 1, shapes=("line",), seed=2)
    return partial(_compare_methods, METHODS)(None, scene)


def test_a_scene_is_measured(row):
    for thing in row["objects"]:
        assert all(0 < thing[method]["chamfer"] < 30 and 0 < thing[method]["iou"] < 1 for method in METHODS)
        assert thing["symmetry"]["iou"] > 0.6
    assert row["symmetry"] < 0.002  # the reference arrangement keeps clear
    # Pairs are drawn on both sides of the limit, as deep as they were wished.
    assert all(0 <= pair["penetration"] < 0.013 for pair in row["pairs"])
    assert {pair["penetration"] > 0.002 for pair in row["pairs"]} == {True, False}


def test_rates_count_what_the_rows_say(row):
    rates = _rates([row])["symmetry"]
    colliding = [pair for pair in row["pairs"] if pair["penetration"] > 0.002]
    assert rates["pairs_colliding"]["n"] == len(colliding)
    assert rates["pairs_colliding"]["count"] == sum(pair["symmetry"] > 0.002 for pair in colliding)
    assert rates["free"] == pytest.approx({"count": 1, "n": 1, "rate": 1.0, "low": rates["free"]["low"], "high": 1.0})
    assert rates["chamfer"] == pytest.approx(np.mean([thing["symmetry"]["chamfer"] for thing in row["objects"]]))


@pytest.mark.parametrize("library", [procedural_objects(17), load_objects("ycb")], ids=["parts", "scan"])
def test_the_true_body_is_nearest(library):
    model = next(model for model in library if model.category == "can")
    truth = _Truth(model, np.eye(4), np.random.default_rng(0))
    chamfer, iou = truth.errors(model, np.eye(4), np.random.default_rng(1))
    moved = np.eye(4)
    moved[0, 3] = 0.01
    assert iou > 0.99 and chamfer < 2.5
    worse_chamfer, worse_iou = truth.errors(model, moved, np.random.default_rng(1))
    assert worse_iou < 0.9 and worse_chamfer > chamfer + 1


def test_the_table_names_every_method_structure_and_noun(row):
    report = {
        "rows": [row],
        "command": "structagent evaluate completion",
        "aggregate": {"line": _rates([row])},
        "lost": [],
    }
    report["aggregate"]["all"] = report["aggregate"]["line"]
    means = {method: {"n": 1, "chamfer": 1.0, "iou": 0.5} for method in METHODS}
    report["nouns"] = {"bottle": means}
    told = io.StringIO()
    print_completion(report, told)
    assert all(word in told.getvalue() for word in (*METHODS, "line", "bottle", "1.0 / 0.50", "pairs free"))


def compared_but_for_lines(methods, loaded, scene):
    if scene.structure == "line":
        os._exit(9)
    return _compare_methods(methods, loaded, scene)


def test_a_worker_that_dies_costs_its_scene(objects, monkeypatch, capsys):
    monkeypatch.setattr(completion, "_compare_methods", compared_but_for_lines)
    command = ["evaluate", "completion", "--objects", objects, "--scenes", "1", "--workers", "2"]
    assert command_line([*command, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [row["structure"] for row in report["rows"]] == ["circle", "tower", "table setting"]
    assert report["lost"] == [{"structure": "line", "number": 0, "seed": 0, "lost": "worker died (exit code 9)"}]
    print_completion(report, sys.stdout)
    assert "1 scene is left out of these figures because a worker died" in capsys.readouterr().out
