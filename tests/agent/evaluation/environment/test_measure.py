"""The leaderboard: its rates, its options, and the command from its episodes to the report."""

import json

import pytest

from agent.cli.app import command_line
from agent.errors import DONE, USAGE, UsageError
from agent.evaluation.environment.config import BASELINES, EnvironmentConfig, checked_policies


def row(success: bool, **more) -> dict:
    known = {
        "structure": "line",
        "failure": None if success else "semantic",
        "actions": 3,
        "refused": [],
        "seconds": 1.0,
    }
    return {"policy": "random", "episode": 0, "success": success, **known, **more}


def test_rates_count_lost_episodes_as_failed():
    pytest.importorskip("gymnasium", reason="the environment needs the package gymnasium")
    from agent.evaluation.environment.measure import _rates
    from agent.evaluation.rows import LOST

    lost = {"policy": "random", "episode": 3, "seed": 3, LOST: "a worker died"}
    rates = _rates("random", [row(True), row(False), row(False, structure="tower", refused=["no plan"]), lost])
    assert (rates["n"], rates["success"]["count"], rates["success"]["n"], rates["lost"]) == (4, 1, 4, 1)
    assert rates["success"]["low"] < 0.25 < rates["success"]["high"]
    assert rates["structures"]["line"]["n"] == 2 and rates["structures"]["tower"]["count"] == 0
    assert rates["failures"]["semantic"] == 2 and rates["refused"] == 1 and rates["actions"] == 3


def test_policies_are_baselines_or_planners():
    assert checked_policies(None) == BASELINES == ("random", "geometric", "diffusion")
    assert checked_policies(["geometric", "random", "geometric"]) == ("geometric", "random")
    with pytest.raises(UsageError, match="--policy cannot be 'geometrik'; legal: random, or a planner: did you mean"):
        checked_policies(["geometrik"])


def test_the_command_of_a_report_names_what_decides_it():
    config = EnvironmentConfig("ycb", seed=3)
    options = "--objects ycb --episodes 30 --seed 3 --candidates 64 --mode place --actions 20"
    assert config.command(BASELINES, 30) == f"structagent evaluate environment {options}"
    by_arm = EnvironmentConfig("ycb", mode="arm", actions=5, structures=("line",)).command(["random"], 2)
    assert by_arm.endswith("--policy random --structure line --candidates 64 --mode arm --hold friction --actions 5")


def test_an_unknown_policy_is_refused_before_anything_is_drawn(capsys):
    pytest.importorskip("gymnasium", reason="the environment needs the package gymnasium")
    assert command_line(["evaluate", "environment", "--policy", "nobody", "--episodes", "1"]) == USAGE
    assert "--policy cannot be 'nobody'" in capsys.readouterr().err


def test_the_leaderboard_of_two_policies_is_resumed(tmp_path, capsys, in_this_process):
    pytest.importorskip("gymnasium", reason="the environment needs the package gymnasium")
    command = ["evaluate", "environment", "--objects", "blocks", "--out", str(tmp_path), "--json", "--candidates", "8"]
    command += [
        "--actions",
        "8",
        "--policy",
        "random",
        "--policy",
        "geometric",
        "--workers",
        "1",
        "--structure",
        "line",
    ]
    assert command_line([*command, "--episodes", "1"]) == DONE
    first = json.loads(capsys.readouterr().out)
    assert command_line([*command, "--episodes", "2"]) == DONE
    report = json.loads(capsys.readouterr().out)
    assert report == json.loads((tmp_path / "eval.json").read_text())
    assert (report["n"], report["seed"], report["mode"]) == (4, 0, "place") and "--episodes 2" in report["command"]
    assert [row for row in report["rows"] if row["episode"] == 0] == first["rows"]
    same = {row["episode"]: row["instruction"] for row in report["rows"]}
    assert all(row["instruction"] == same[row["episode"]] for row in report["rows"])
    assert {rates["policy"] for rates in report["leaderboard"]} == {"random", "geometric"}
    assert [rates["success"]["rate"] for rates in report["leaderboard"]] == sorted(
        (rates["success"]["rate"] for rates in report["leaderboard"]), reverse=True
    )
    assert command_line([*command[:-1], "--episodes", "2", "--seed", "1"]) == USAGE


def test_without_gymnasium_the_command_says_what_to_install(monkeypatch, capsys):
    import sys

    monkeypatch.setitem(sys.modules, "gymnasium", None)
    monkeypatch.setitem(sys.modules, "gymnasium.envs.registration", None)
    assert command_line(["evaluate", "environment", "--episodes", "1"]) == USAGE
    assert "pip install 'structagent[gym]'" in capsys.readouterr().err
