"""The seconds of the arm's planning: the steps add up to the whole, and hold what they name."""

import pytest

from agent.evaluation.arm_planning import GRASPS, MOTIONS, REACH, OuterClock, measure_arm_planning


def test_the_steps_of_planning_add_up():
    row = measure_arm_planning(objects=3, runs=1, candidates=8)
    steps = {step["step"]: step for step in row["steps"]}
    assert row["planned"] == row["runs"] == 1 and row["objects"] == [3]
    assert sum(step["seconds"] for step in row["steps"]) == pytest.approx(row["seconds_median"])
    assert steps[GRASPS]["calls"] == 3 and steps[MOTIONS]["calls"] >= 6  # three motions for each object, or two
    assert all(step["seconds"] > 0 for step in row["steps"]) and steps[REACH]["calls"] >= 3
    assert row["checks"] > 100


def test_a_step_within_a_step_is_part_of_it():
    clock = OuterClock()
    with clock("outer"), clock("inner"):
        pass
    with clock("inner"):
        pass
    assert {name: step[2] for name, step in clock.steps.items()} == {"outer": 1, "inner": 1}
