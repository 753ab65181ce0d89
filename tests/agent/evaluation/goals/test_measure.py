"""`structagent evaluate goals` on toy blocks: rows, resumption, the report, and errors."""

import json

import numpy as np
import pytest

from agent.cli.app import command_line
from agent.evaluation.goals.config import checked_families
from agent.evaluation.goals.solve import failed_parts, judge_disturbed, rival_verdicts, solve_goal_scene
from structdiffusion.benchmark.goal_families import FAMILIES
from structdiffusion.benchmark.goals import draw_goal_scene
from structdiffusion.objects.blocks import block_objects
from structdiffusion.planners.goal_planner import GoalArrangement
from structdiffusion.structures.structure import LayoutError


class Stub:
    """A planner that proposes given motions, or raises."""

    def __init__(self, motions=None):
        self.motions = motions

    def propose(self, scene, goal, *, count, generator, colors):
        if self.motions is None:
            raise LayoutError("these objects are too large")
        return [GoalArrangement((0,), (), self.motions, {"total": 1.0})]


@pytest.fixture(scope="module")
def scene():
    return draw_goal_scene(block_objects(), "structure-and-relation", 0, seed=5)


def test_a_row_of_a_goal_that_is_met(scene):
    row, observed, arrangements = solve_goal_scene(Stub(scene.reference), scene, 4)
    assert row["success"] and row["failure"] is None and row["failed_parts"] == [] and row["proposed"] == 1
    assert row["goal"] == scene.goal.to_dict() and row["kind"] == scene.kind and row["number"] == 0
    assert len(observed.objects) == len(scene.models) == len(row["objects"]) and len(arrangements) == 1
    assert json.loads(json.dumps(row)) == row


def test_a_row_of_a_goal_that_is_not_met_names_the_parts(scene):
    still = scene.reference.copy()
    (structure,) = scene.goal.structures
    still[structure.objects[0]] = scene.reference[structure.objects[1]]  # into the place of another
    row, *_ = solve_goal_scene(Stub(still), scene, 4)
    assert not row["success"] and row["detail"]
    assert set(row["rivals"].values()) <= {None, False, True}
    left = scene.verdict(np.array([np.eye(4)] * len(scene.models)))
    assert left.failure == "semantic" and set(failed_parts(scene, left)) & {
        structure.shape,
        scene.goal.relations[0].relation,
    }


def test_a_row_without_an_arrangement(scene):
    row, _, arrangements = solve_goal_scene(Stub(), scene, 4)
    assert row["failure"] == "no arrangement" and row["detail"] == "these objects are too large" and arrangements == []
    assert (
        all(value in (None, False) for value in row["rivals"].values()) and rival_verdicts(scene, None) == row["rivals"]
    )


def test_disturbed_references_are_near_and_mostly_not_accepted(scene):
    rows = [judge_disturbed(draw_goal_scene(block_objects(), "metric", number, seed=5)) for number in range(4)]
    assert rows[0] == judge_disturbed(draw_goal_scene(block_objects(), "metric", 0, seed=5)) | {
        key: rows[0][key] for key in ("seconds", "verdict")
    }
    assert sum(row["success"] for row in rows) <= 2
    assert any(row["rivals"]["LGMCTS"] and not row["success"] for row in rows)


@pytest.mark.usefixtures("in_this_process")
def test_rows_are_kept_and_an_evaluation_is_resumed(tmp_path, capsys):
    out = tmp_path / "out"
    asked = ["evaluate", "goals", "--objects", "blocks", "--model", "geometric", "--family", "single-objects",
             "--workers", "1", "--out", str(out), "--json"]  # fmt: skip
    assert command_line([*asked, "--scenes", "2"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["n"] == 2 and [row["kind"] for row in report["rows"]] == ["at corner", "on"]
    assert report["aggregate"]["geometric"]["single-objects"]["success"]["n"] == 2
    assert "--family single-objects" in report["command"]
    rows = (out / "rows.jsonl").read_text()
    assert command_line([*asked, "--scenes", "3"]) == 0
    resumed = json.loads(capsys.readouterr().out)
    assert resumed["n"] == 3 and resumed["rows"][:2] == report["rows"]
    assert (out / "rows.jsonl").read_text().startswith(rows)
    assert json.loads((out / "eval.json").read_text()) == resumed
    assert command_line([*asked, "--scenes", "2", "--seed", "1"]) == 2
    assert "--seed" in capsys.readouterr().err


def test_unknown_families_are_named_with_the_legal_ones(capsys):
    assert command_line(["evaluate", "goals", "--family", "towers"]) == 2
    error = capsys.readouterr().err
    assert "'towers'" in error and "two-structures" in error
    assert checked_families(["order", "metric"]) == ("metric", "order") and checked_families(None) == tuple(FAMILIES)
