"""`structagent evaluate coverage`: which values samples realise, and how evenly."""

import io
import json
import math
import os
import sys

import numpy as np
import pytest

from agent.cli.app import command_line
from agent.evaluation import coverage
from agent.evaluation.coverage import (
    RANKED,
    SAMPLED,
    VIABLE,
    _coverage_rows,
    _draw_scene,
    _mean,
    _spread,
    open_slots,
    print_coverage,
)
from agent.evaluation.report import report_by_structure, report_frame
from grounding.spec import StructureSpec
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement
from structdiffusion.planners.factory import load_planner

MODELS = [procedural_object(kind, index) for kind in ("block", "can", "box") for index in range(3)]


@pytest.fixture(scope="module")
def tower():
    return _draw_scene(20, MODELS, ("tower", 0))


class Copier:
    """A planner that moves everything by so much, in turn, with such a score."""

    def __init__(self, *shifts):
        self.shifts = shifts

    def propose(self, scene, goal, *, count=64, generator):
        return [
            Arrangement(np.array([pose_from_xyz_yaw(dx, dy, 0.0, 0.0)] * len(scene.objects)), {"total": score})
            for dx, dy, score in self.shifts
        ]


def test_what_may_differ():
    assert open_slots(StructureSpec("line", size="small")) == ["x_position", "y_position", "rotation"]
    assert open_slots(StructureSpec("circle")) == ["size", "x_position", "y_position"]  # a closed ring faces nowhere
    assert open_slots(StructureSpec("table setting", rotation="east")) == ["x_position", "y_position"]
    assert open_slots(StructureSpec(x_position="left")) == ["shape"]


def test_a_planner_that_always_does_the_same_covers_nothing(tower):
    x, y = _coverage_rows(64, Copier(*[(0.0, 0.0, 0.9)] * 6), tower)
    assert (x["slot"], y["slot"]) == ("x_position", "y_position")
    assert set(x["fits"]) == {"left", "center", "right"} and sum(x["realised"][SAMPLED].values()) == 6
    assert all(even == 0.0 for even in (*x["evenness"].values(), *y["evenness"].values()))


def test_only_what_differs_counts_and_bad_samples_are_not_worth_it(tower):
    # Far to the left, and far to the right with a score that is not worth a try.
    x, y = _coverage_rows(64, Copier((0.0, 2.0, 0.9), (0.0, 2.0, 0.8), (0.0, -2.0, 0.01), (0.0, -2.0, 0.0)), tower)
    assert x["realised"][SAMPLED] == {"left": 2, "right": 2} and x["realised"][VIABLE] == {"left": 2}
    assert x["evenness"][SAMPLED] == pytest.approx(math.log(2) / 0.78275, rel=1e-4)  # of the 81 ways to draw
    assert x["evenness"][VIABLE] == 0.0 and y["evenness"][SAMPLED] == 0.0
    nothing = _coverage_rows(64, Copier(), tower)[0]
    assert nothing["realised"][SAMPLED] == {} and nothing["evenness"][RANKED] is None


def test_the_exact_planner_covers_what_is_open():
    rows = _coverage_rows(24, load_planner("geometric"), _draw_scene(20, MODELS, ("line", 0)))
    assert [row["slot"] for row in rows] == ["size", "x_position", "y_position", "rotation"]
    assert all(row["evenness"][SAMPLED] > 0.6 for row in rows)
    assert set(rows[3]["realised"][SAMPLED]) <= {"north", "east"} == set(rows[3]["fits"])


def test_means_come_with_what_they_rest_on(tower):
    assert _mean([None, None])["mean"] is None and _mean([0.4, None]) == {"n": 1, "mean": 0.4, "low": 0.0, "high": 1.4}
    two = _mean([0.4, 0.6])
    assert (two["n"], two["mean"], two["low"]) == (2, 0.5, 0.0)
    many = _mean([0.4, 0.6] * 8)
    assert many["low"] == pytest.approx(0.5 - 2.131 * 0.1033 / 4, abs=1e-3) and many["high"] < 0.56

    rows = _coverage_rows(64, Copier((0.0, 2.0, 0.9), (0.0, -2.0, 0.9)), tower)
    report = report_by_structure(report_frame("structagent evaluate coverage", len(rows), 20), rows, _spread)
    assert report["aggregate"]["tower"]["x_position"][SAMPLED]["shares"] == {"left": 0.5, "center": 0.0, "right": 0.5}
    told = io.StringIO()
    print_coverage(report | {"lost": []}, told)
    assert "left 50 %, center 0 %, right 50 %" in told.getvalue()


@pytest.mark.usefixtures("in_this_process")
def test_from_the_command_line(objects, capsys):
    arguments = ["evaluate", "coverage", "--objects", objects, "--model", "geometric", "--scenes", "1"]
    assert command_line([*arguments, "--workers", "1", "--candidates", "6", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert set(report["aggregate"]) == {"circle", "line", "tower", "table setting", "structure", "all"}
    assert report["aggregate"]["structure"]["shape"]["n"] == 1 and len(report["rows"]) == 13


def rows_but_for_lines(candidates, planner, scene):
    if scene.structure == "line":
        os._exit(9)
    return _coverage_rows(candidates, planner, scene)


def test_a_worker_that_dies_costs_its_scene(objects, monkeypatch, capsys):
    monkeypatch.setattr(coverage, "_coverage_rows", rows_but_for_lines)
    command = ["evaluate", "coverage", "--objects", objects, "--model", "geometric", "--scenes", "1"]
    command += ["--workers", "1", "--candidates", "6"]
    assert command_line([*command, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert set(report["aggregate"]) == {"circle", "tower", "table setting", "structure", "all"}
    assert report["lost"] == [{"structure": "line", "number": 0, "seed": 0, "lost": "worker died (exit code 9)"}]
    print_coverage(report, sys.stdout)
    assert "1 scene is left out of these figures because a worker died" in capsys.readouterr().out
