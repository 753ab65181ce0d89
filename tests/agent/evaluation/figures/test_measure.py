"""`structagent evaluate figures`: rows, resumption, the tables, and errors."""

import json

from agent.cli.app import command_line
from agent.evaluation.figures.rates import rates_of


def row(kind, success, family="gate", named="gate", **more):
    return {
        "method": "name", "family": family, "number": 0, "seed": 0, "draw": 0, "kind": kind, "success": success,
        "success_at_5": success, "failure": None if success else "semantic", "failed_checks": [] if success else ["a"],
        "named": named, "seconds": 2.0,
    } | more  # fmt: skip


def test_rates_and_what_a_changed_number_costs():
    rows = [
        row("same objects", True),
        row("other objects", True, named="arch"),
        row("two thirds", False, success_at_5=True),
        row("up to twice", True),
    ]
    rates = rates_of(rows)
    assert (rates["success"]["count"], rates["success_at_5"]["count"], rates["named"]["count"]) == (3, 4, 3)
    assert rates["loss"] == 0.5 and rates["transfers"]["two thirds"]["rate"] == 0.0
    assert (
        rates["failures"]["semantic"]["count"] == 1 and rates["failed_checks"] == {"a": 1} and rates["seconds"] == 2.0
    )
    assert rates_of(rows[:1])["loss"] is None
    assert rates_of([{"method": "name", "family": "gate", "number": 0, "seed": 0, "lost": "died"}])["lost"] == 1


def test_a_gate_is_built_and_its_row_is_kept(tmp_path, capsys, in_this_process, quick_arm):
    options = [
        "evaluate",
        "figures",
        "--objects",
        "blocks",
        "--model",
        "geometric",
        "--family",
        "gate",
        "--scenes",
        "1",
        "--seed",
        "1",
    ]
    options += ["--method", "name", "--arm", "--hold", "weld", "--out", str(tmp_path)]
    assert command_line(options) == 0
    table = capsys.readouterr().out
    assert "100 % of 1" in table and "with the arm" in table and "structagent evaluate figures" in table
    report = json.loads((tmp_path / "eval.json").read_text())
    (row,) = report["rows"]
    assert row["family"] == "gate" and row["count"] == 5 and row["success"] and row["named"] == "gate"
    assert row["arm"]["stands"] and row["arm"]["placed"] == 5 and report["command"].endswith("--arm --hold weld")
    assert command_line(options) == 0  # nothing is computed again
    assert json.loads((tmp_path / "eval.json").read_text())["rows"] == [row]


def test_unknown_names_are_refused(capsys, in_this_process):
    for option, value in (("--family", "unicorn"), ("--method", "magic")):
        assert command_line(["evaluate", "figures", option, value]) == 2
        assert f"{option} cannot be '{value}'; legal values: " in capsys.readouterr().err
