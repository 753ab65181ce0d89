"""`structagent evaluate loop` on toy blocks: one build, rows, resumption, rates and the report."""

import io
import json

import pytest

from agent.arm.disturbances import DISTURBANCES
from agent.cli.app import command_line
from agent.errors import UsageError
from agent.evaluation.loop.build import LoopBuild
from agent.evaluation.loop.rates import rates_of
from agent.evaluation.loop.report import print_loop
from agent.evaluation.planner_config import checked_names
from structdiffusion.benchmark.goals import draw_goal_scene
from structdiffusion.objects.blocks import block_objects
from structdiffusion.planners.goal_planner import GoalArrangement

pytestmark = pytest.mark.usefixtures("quick_arm")


@pytest.fixture(scope="module")
def build():
    scene = draw_goal_scene(block_objects(), "flat-structure", 1, seed=2)
    moved = tuple(scene.goal.structures[0].objects)
    arrangement = GoalArrangement(moved, (), scene.reference, {"total": 1.0})
    return LoopBuild(scene, scene.observed(), [arrangement], "weld", block_objects())


def test_an_undisturbed_row(build):
    row = build.row("none")
    assert row["planned"] and row["success"] and not row["false_done"] and row["failed_checks"] == []
    assert row["said"] == row["to_place"] >= 3 and row["noticed"] is row["disturbed"] is None and row["replans"] == 0
    assert row["happened"][0] == "planned" and row["arm_seconds"] > 5.0 and json.loads(json.dumps(row)) == row


# The others are disturbed in tests/agent/arm/test_disturbances.py.
@pytest.mark.parametrize("kind", ["drop", "remove"])
def test_a_disturbed_row(build, kind):
    row = build.row(kind)
    assert row["disturbed"] and row["why_not"] == "" and row["noticed"] in (False, True)
    assert sum(line.startswith("disturbed ") for line in row["happened"]) == 1
    if kind == "remove":
        assert row["said"] < row["to_place"] and row["disturbed"].endswith("was taken off the table")
    assert json.loads(json.dumps(row)) == row


def test_a_row_without_an_arrangement(build):
    scene = build.scene
    row = LoopBuild(scene, scene.observed(), [], "weld", block_objects()).row("push")
    assert not row["planned"] and not row["success"] and row["why_not"].endswith("nothing was built")


@pytest.mark.usefixtures("in_this_process")
def test_rows_are_kept_and_an_evaluation_is_resumed(tmp_path, capsys):
    out = tmp_path / "out"
    asked = ["evaluate", "loop", "--objects", "blocks", "--model", "geometric", "--family", "tower",
             "--scenes", "1", "--workers", "1", "--hold", "weld", "--out", str(out)]  # fmt: skip
    assert command_line([*asked, "--disturb", "push", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [row["disturbance"] for row in report["rows"]] == ["none", "push"]
    assert report["aggregate"]["push"]["tower"]["n"] == 1
    assert "evaluate loop --objects blocks --scenes 1 --seed 0 --model geometric --disturb push" in report["command"]
    rows = (out / "rows.jsonl").read_text()
    assert command_line([*asked, "--disturb", "remove"]) == 0
    assert (out / "rows.jsonl").read_text().startswith(rows)
    printed = capsys.readouterr().out
    assert "remove" in printed and "push" in printed and "ratio: to the same scenes undisturbed" in printed


def row(kind, number, success, **more):
    return {
        "disturbance": kind, "family": "tower", "number": number, "success": success, "said": 3, "to_place": 3,
        "disturbed": None if kind == "none" else "can was pushed", "false_done": False, "noticed": kind == "push",
        "replans": 0, "seconds": 10.0, "arm_seconds": 40.0,
    } | more  # fmt: skip


ROWS = [
    row("none", 0, True),
    row("none", 1, True, replans=1),
    row("none", 2, False, false_done=True),
    row("push", 0, True, seconds=14.0, arm_seconds=52.0),
    row("push", 1, False, noticed=False, said=2, false_done=True, seconds=12.0),
    row("push", 2, False, disturbed=None),
]


def test_rates_of_rows():
    plain, pushed = rates_of(ROWS, "none"), rates_of(ROWS, "push")
    assert (plain["n"], plain["success"]["count"], plain["replans"]["count"]) == (3, 2, 1)
    assert plain["false_done"]["count"] == 1 and plain["noticed"] is None and plain["impossible"] == 0
    assert (pushed["n"], pushed["impossible"]) == (2, 1)
    assert (pushed["success"]["count"], pushed["undisturbed"]["count"]) == (1, 2)
    assert pushed["ratio"] == 0.5 and pushed["noticed"]["count"] == 1 and pushed["false_done"]["count"] == 1
    assert pushed["said"] == {"2 of 3": 1, "3 of 3": 1}
    assert pushed["extra_seconds"] == 3.0 and pushed["extra_arm_seconds"] == 6.0
    died = {"disturbance": "push", "family": "tower", "number": 3, "lost": "worker died"}
    assert rates_of([*ROWS, died], "push")["n"] == 3 and rates_of([*ROWS, died], "push")["lost"] == 1


def test_the_tables():
    families = {"tower": None, "all": None}
    report = {
        "command": "structagent evaluate loop", "left_out": 0,
        "aggregate": {kind: {name: rates_of(ROWS, kind) for name in families} for kind in ("none", "push")},
    }  # fmt: skip
    out = io.StringIO()
    print_loop(report, out)
    assert "1 build is left out, in which the disturbance could not happen" in out.getvalue()
    assert "2 of 3 in 1, 3 of 3 in 1" in out.getvalue() and "0.50" in out.getvalue()


def test_unknown_names_are_answered_with_the_legal_ones(capsys):
    assert command_line(["evaluate", "loop", "--disturb", "pull"]) == 2
    error = capsys.readouterr().err
    assert "'pull'" in error and all(kind in error for kind in DISTURBANCES)
    with pytest.raises(UsageError, match="--family cannot be 'x'; legal values: a, b"):
        checked_names("family", ["x"], ("a", "b"))
    assert checked_names("family", ["b", "a"], ("a", "b", "c")) == ("a", "b") and checked_names(
        "family", None, ("a",)
    ) == ("a",)
