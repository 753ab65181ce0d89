import numpy as np
import pytest
import torch

from structdiffusion.benchmark.latency import (
    StepClock,
    decide,
    loaded,
    measure_decisions,
    observed_scenes,
    spec_of,
)
from structdiffusion.observation import StructureGoal


def test_scenes_have_as_many_objects_as_asked_for_and_differ():
    first, second = observed_scenes("circle", 5, 2)
    assert len(first.objects) == len(second.objects) == 5 and not first.distractors
    assert not np.array_equal(first.objects[0].points[:9], second.objects[0].points[:9])


@pytest.mark.parametrize("shape", ["circle", "tower"])
def test_the_steps_on_the_clock_give_what_the_planner_proposes(shape):
    planner = loaded("diffusion-tokens")
    (scene,) = observed_scenes(shape, 3, 1)
    goal, clock = StructureGoal(spec_of(shape)), StepClock()
    proposed = planner.propose(scene, goal, count=6, generator=torch.Generator().manual_seed(2))
    timed = decide(planner, scene, goal, 6, torch.Generator().manual_seed(2), clock)
    assert [row.scores for row in timed] == [row.scores for row in proposed]
    for one, other in zip(timed, proposed, strict=True):
        np.testing.assert_array_equal(one.goal_from_initial, other.goal_from_initial)
    calls = {name: step[2] for name, step in clock.steps.items()}
    trials = calls.pop("try in physics")
    expected = {"encode the clouds": 3, "sample": 10, "refine": 6, "rank": 6, "complete the bodies": 3}
    assert calls == expected and trials >= 1


def test_medians_lie_between_the_extremes_and_steps_add_up():
    (row,) = measure_decisions("diffusion-tokens", [("line", 3)], candidates=2, runs=3)
    assert 0 < row["seconds_min"] <= row["seconds_median"] <= row["seconds_max"]
    assert (row["structure"], row["objects"], row["candidates"], row["runs"]) == ("line", [3], 2, 3)
    assert 0 < sum(step["seconds"] for step in row["steps"]) <= 3 * row["seconds_max"]
    assert row["cpu_seconds_median"] > 0


def test_what_a_stand_in_for_a_sentence_asks_for_is_not_tried_out():
    (row,) = measure_decisions("diffusion", [("circle", 3)], candidates=2, runs=1)
    assert row["seconds_median"] > 0
    assert [step["step"] for step in row["steps"]] == ["encode the clouds", "sample", "refine", "rank"]


def test_an_unknown_model_is_named():
    with pytest.raises(ValueError, match="model cannot be 'magic'; legal values: diffusion, "):
        measure_decisions("magic", [("circle", 3)], candidates=2, runs=1)
