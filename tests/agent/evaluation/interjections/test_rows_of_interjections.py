"""What people may say while the arm builds: the file, the tables that are drawn for it,
and how what comes of it is judged.
"""

import numpy as np
import pytest

from agent import events
from agent.arm.events import Picked, Placed, Stopped
from agent.evaluation.interjections.measure import RESULTS, SteeringConfig, _judged, _row_of, measure_steering
from agent.evaluation.interjections.report import print_steering
from agent.evaluation.interjections.rows import HALVES, Saying, sayings, tables, write_table
from agent.pipeline.resources import ResourceCache
from agent.scenes.object_placement import load_scene
from tests.grounding.goal_in_words import goal_of_words

OUTCOMES = {"changed", "first", "waits", "answered", "stops", "refused", "unchanged", "asked"}


def test_every_saying_has_a_table_an_outcome_and_a_goal_that_is_spelled_as_goals_are():
    assert len(sayings()) == 60 and [sum(one.half == half for one in sayings()) for half in HALVES] == [30, 30]
    assert len({(one.instruction, one.sentence) for one in sayings()}) == 60
    for one in sayings():
        assert one.table in tables() and set(one.outcomes) <= OUTCOMES
        assert bool(one.goals) == (one.outcomes[0] in ("changed", "first"))
        if one.outcomes == ("changed",):
            assert tuple(str(goal_of_words(goal).canonical()) for goal in one.goals) == one.goals
        if one.outcomes == ("first",):
            assert int(one.goals[0]) < len(tables()[one.table])


@pytest.mark.parametrize("name", ["desk", "dinner", "fruit", "cans"])
def test_a_table_is_drawn_anew_with_the_same_objects(name, tmp_path):
    drawn = []
    for number in range(2):
        write_table(name, np.random.default_rng(number), path := tmp_path / f"{number}.yaml")
        drawn.append(load_scene(path))
        assert [one.name for one in drawn[-1]] == list(tables()[name])
    assert not np.allclose(drawn[0][0].world_from_object, drawn[1][0].world_from_object)


def saying(outcome, *goals):
    return Saying(0, "seen", "desk", "put the cups in a line", "something", (outcome,), goals)


def said(outcome):
    return events.Interjected("something", outcome, "", 1)


def placed(name, aside=False):
    return Placed(0, name, aside, 0.0, 0.0, np.eye(4), 1.0)


BEFORE, AFTER = "line of 0, 1, 2", "circle of 0, 1, 2"
TURNED = events.Started("something", {})


@pytest.mark.parametrize(
    "expected, happened, goal, result",
    [
        (saying("changed", AFTER), [], BEFORE, "dropped"),
        (saying("changed", AFTER), [said("changed"), placed("cup 1"), TURNED], AFTER, "right"),
        (saying("changed", AFTER), [said("changed"), placed("cup 1"), placed("cup 2"), TURNED], AFTER, "late"),
        (saying("changed", AFTER), [said("changed"), TURNED], BEFORE, "wrong"),
        (saying("changed", AFTER), [said("changed"), placed("cup 1")], AFTER, "wrong"),
        (saying("changed", AFTER), [said("changed"), said("refused")], BEFORE, "wrong"),
        (saying("changed", AFTER), [said("asked")], BEFORE, "asked"),
        (saying("refused"), [said("refused"), placed("cup 1")], BEFORE, "right"),
        (saying("refused"), [said("changed"), TURNED], AFTER, "wrong"),
        (saying("answered"), [said("answered")], BEFORE, "right"),
        (saying("stops"), [said("stops"), Stopped(0, "cup 1", True, True)], BEFORE, "right"),
        (saying("stops"), [said("stops"), placed("cup 1"), Stopped(0, "cup 1", True, True)], BEFORE, "wrong"),
        (saying("stops"), [said("stops"), events.Failed("build", "interrupted", 130)], BEFORE, "right"),
        (saying("first", "1"), [said("changed"), placed("cup 3"), TURNED, placed("cup 2")], BEFORE, "right"),
        (saying("first", "1"), [said("changed"), TURNED, placed("cup 1"), placed("cup 3"), placed("cup 2")], BEFORE,
         "wrong"),
        (saying("first", "1"), [Picked(0, "cup 2", "across", 1, 3, "weld"), said("unchanged")], BEFORE, "right"),
        (saying("first", "1"), [said("unchanged")], BEFORE, "wrong"),
    ],
)  # fmt: skip
def test_what_comes_of_a_saying_is_judged(expected, happened, goal, result):
    told = [event for event in happened if isinstance(event, events.Interjected)]
    assert _judged(happened, told, expected, goal, BEFORE) == result and result in RESULTS


@pytest.mark.usefixtures("quick_arm")
def test_a_saying_is_measured_on_a_drawn_table():
    one = next(one for one in sayings() if one.sentence == "leave the red one out")
    row = _row_of(SteeringConfig(model="geometric", hold="weld"), ResourceCache(), one)
    assert row["result"] == "right" and row["goal"] == "line of 1, 2, right" and row["stands"], row


def test_a_report_of_no_rows_names_its_command(monkeypatch, capsys):
    import sys

    monkeypatch.setattr("agent.evaluation.interjections.measure.sayings", tuple)
    report = measure_steering(SteeringConfig(model="geometric"), ["seen"], workers=0)
    assert report["n"] == 0 and report["command"].startswith("structagent evaluate steering")
    print_steering(report, sys.stdout)
    assert "right: read as expected" in capsys.readouterr().out
