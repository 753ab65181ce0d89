"""Single picks: what is held, what slips, and what is left out before anything moves."""

import json

import numpy as np
import pytest

from agent.arm.events import Picked, PickFailed, PlanFailed
from agent.cli.app import command_line
from agent.evaluation import picks
from agent.evaluation.picks import Pick, _outcome, _pick, _rates
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object

PICKED = Picked(0, "can", "across", 1, 3, "friction")
SLIPPED = PickFailed(0, "can", "across", 1, "it slipped out of the fingers")


@pytest.mark.parametrize("kind, hold, planned", [("candle", "friction", True), ("book", "friction", False), ("book", "weld", True)])
def test_a_pick(kind, hold, planned):
    row = _pick(hold, 0, None, Pick(procedural_object(kind, 0), 3))
    assert row["stood"] and row["planned"] == planned == row["held"] == row["stands"]
    assert (row["error_m"] < 0.03) == planned and bool(row["grasps"]) == planned
    assert planned or row["failures"] == ["no grasp fits the hand"]


def test_outcomes_and_their_rates():
    here, off, over = (pose_from_xyz_yaw(x, 0.0, 0.0, 0.0) for x in (0.4, 0.46, 0.4))
    over[:3, :3] = np.diag((1.0, -1.0, -1.0))
    rows = [
        _outcome([PICKED], here, here),
        _outcome([SLIPPED, PICKED], off, here),
        _outcome([SLIPPED], over, here),
        _outcome([PlanFailed(0, 0, "can", "no grasp fits the hand")], off, here),
    ]
    rates = _rates(rows)
    assert rates["n"] == 4 and [rates[key]["n"] for key in ("planned", "at_once", "held", "stands")] == [4, 3, 3, 3]
    assert [rates[key]["count"] for key in ("planned", "at_once", "held", "stands")] == [3, 1, 2, 1]
    assert rows[1]["failures"] == ["it slipped out of the fingers"] and rows[3]["failures"] == ["no grasp fits the hand"]


def test_the_command_names_what_is_left_out(tmp_path, monkeypatch, capsys):
    things = [procedural_object("candle", 1), procedural_object("book", 1)]
    monkeypatch.setattr(picks, "load_objects", lambda _: things)
    monkeypatch.setattr(picks, "in_parallel", lambda task, *others: map(lambda job: task(None, job), others[2]))
    out = tmp_path / "picks.json"
    assert command_line(["evaluate", "picks", "--picks", "2", "--seed", "4", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "left out before anything moved: book_0_001" in printed
    assert "structagent evaluate picks --objects training --picks 2 --seed 4 --hold friction" in printed
    report = json.loads(out.read_text())
    assert report["aggregate"]["n"] == 2 and report["aggregate"]["planned"]["count"] == 1
    assert report["kinds"]["candle"]["stands"]["count"] == 1
