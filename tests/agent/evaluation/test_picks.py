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
from structdiffusion.objects.solids import assemble, box

PICKED = Picked(0, "can", "across", 1, 3, "friction")
SLIPPED = PickFailed(0, "can", "across", 1, "it slipped out of the fingers")


CHEST = assemble(
    "chest", "chest", [box(0.2, 0.2, 0.0, 0.1)], density=300.0, friction=0.5, color=(0.5, 0.5, 0.5),
    source="procedural",
    rng=np.random.default_rng(0),
)  # fmt: skip


@pytest.mark.parametrize(("kind", "hold"), [("candle", "friction"), ("book", "friction"), ("book", "weld")])
def test_a_pick(kind, hold):
    row = _pick(hold, 0, None, Pick(procedural_object(kind, 0), 3))
    assert row["stood"] and row["planned"] and row["held"] and row["stands"]
    assert row["error_m"] < 0.03 and row["grasps"]


def test_what_is_too_wide_for_the_hand_is_left_out():
    row = _pick("friction", 0, None, Pick(CHEST, 3))
    assert row["stood"] and not row["planned"] and not row["held"] and not row["stands"]
    assert row["grasps"] == [] and row["failures"] == ["no grasp fits the hand"]


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
    assert rows[1]["failures"] == ["it slipped out of the fingers"] and rows[3]["failures"] == [
        "no grasp fits the hand"
    ]


def test_the_command_names_what_is_left_out(tmp_path, monkeypatch, capsys):
    things = [procedural_object("candle", 1), CHEST]
    monkeypatch.setattr(picks, "load_objects", lambda _: things)
    monkeypatch.setattr(picks, "in_parallel", lambda task, *others: (task(None, job) for job in others[2]))
    out = tmp_path / "picks.json"
    assert command_line(["evaluate", "picks", "--picks", "2", "--seed", "4", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "left out before anything moved: chest" in printed
    assert "structagent evaluate picks --objects training --picks 2 --seed 4 --hold friction" in printed
    report = json.loads(out.read_text())
    assert report["aggregate"]["n"] == 2 and report["aggregate"]["planned"]["count"] == 1
    assert report["kinds"]["candle"]["stands"]["count"] == 1
