"""The rates of an evaluation of goals, and its tables, on rows made by hand."""

import io

from agent.evaluation.goal_rows import RowsWanted, SceneJob
from agent.evaluation.goals.config import GoalsConfig
from agent.evaluation.goals.measure import report_of
from agent.evaluation.goals.rates import rates_of
from agent.evaluation.goals.report import print_goals


def row(number, success, failure=None, model="geometric", family="metric", kind="gap", **more):
    return {
        "model": model, "family": family, "number": number, "kind": kind, "seed": 0, "draw": 0, "success": success,
        "failure": failure, "failed_parts": [], "aside": [], "rivals": {"LGMCTS": None, "SREM": None},
        "plan_seconds": 1.0 + number, "seconds": 2.0,
    } | more  # fmt: skip


ROWS = [
    row(0, True, rivals={"LGMCTS": True, "SREM": True}),
    row(1, False, "semantic", failed_parts=["line", "next to"], rivals={"LGMCTS": True, "SREM": False}, kind="length"),
    row(2, False, "intersection", rivals={"LGMCTS": False, "SREM": None}, aside=[3]),
    row(3, False, "no arrangement"),
]


def rows_without(model, family, number, why, reason):
    wanted = RowsWanted("model", (model,), (family,), number + 1, 0)
    return wanted.without(SceneJob(family, number, None, (model,)), why, reason)


def test_rates_of_rows():
    found = rates_of(ROWS)
    assert (
        found["n"] == 4 and found["success"]["count"] == 1 and found["success"]["low"] < 0.25 < found["success"]["high"]
    )
    assert {cause: rate["count"] for cause, rate in found["failures"].items()} == {
        "intersection": 1, "abnormal velocity": 0, "not upright": 0, "semantic": 1, "no arrangement": 1,
    }  # fmt: skip
    assert found["failed_parts"] == {"line": 1, "next to": 1} and found["aside"] == 1
    assert found["kinds"]["gap"]["n"] == 3 and found["kinds"]["length"]["count"] == 0
    assert found["plan_seconds_median"] == 2.5 and found["plan_seconds_max"] == 4.0 and found["arm"] is None


def test_what_rivals_accept_that_fails_ours():
    rivals = rates_of(ROWS)["rivals"]
    assert (rivals["LGMCTS"]["accepts"]["count"], rivals["LGMCTS"]["accepts"]["n"]) == (2, 3)
    assert (rivals["LGMCTS"]["ours"]["count"], rivals["LGMCTS"]["ours"]["n"]) == (1, 3)
    false = rivals["LGMCTS"]["accepts_what_fails"]  # of the semantic failures alone: physics fails for all
    assert (false["count"], false["n"]) == (1, 1)
    assert rivals["SREM"]["accepts_what_fails"]["count"] == 0


def test_rows_whose_worker_died_count_as_failed():
    died = rows_without("geometric", "metric", 4, "lost", "worker died")
    found = rates_of([*ROWS, *died])
    assert found["n"] == 5 and found["success"]["n"] == 5 and found["lost"] == 1 and found["kinds"]["gap"]["n"] == 3


def test_the_report_has_every_model_and_family_and_leaves_out_what_has_no_scene():
    built = {"planned": True, "placed": 2, "to_place": 2, "stands": True, "seconds": 30.0}
    rows = [*ROWS, row(0, True, model="diffusion", family="order", kind="line by height", arm=built)]
    rows += rows_without("diffusion", "new-shapes", 0, "no_scene", "no scene")
    report = report_of(GoalsConfig("blocks"), rows)
    assert report["n"] == 5 and report["left_out"] == 1 and report["seed"] == 0
    assert "evaluate goals --objects blocks --scenes 4" in report["command"]
    assert list(report["aggregate"]["geometric"]) == ["metric", "order", "new-shapes", "all"]
    assert report["aggregate"]["diffusion"]["order"]["arm"]["stands"]["count"] == 1
    text = io.StringIO()
    print_goals(report, text)
    told = text.getvalue()
    assert "line 1, next to 1" in told and "with the arm" in told and "1 row is left out" in told
