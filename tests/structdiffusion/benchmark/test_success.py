import json
from dataclasses import replace

import numpy as np
import pytest

from structdiffusion.benchmark.scenes import draw_evaluation_scenes
from structdiffusion.benchmark.success import NO_ARRANGEMENT, Evaluation, solve, wilson_interval
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement
from structdiffusion.structures.structure import LayoutError

MODELS = [procedural_object(kind, index) for kind in ("block", "can", "box") for index in range(3)]


class Prepared:
    """A planner that proposes what it was told for each scene, by the number of objects."""

    def __init__(self, ranks):
        self.ranks = ranks
        self.seen = []

    def propose(self, scene, goal, *, count=64, generator):
        self.seen.append((scene, goal, generator.initial_seed()))
        return [Arrangement(motions) for motions in self.ranks(len(scene.objects))]


def stay(count):
    return np.eye(4)[None].repeat(count, 0)


def off_the_table(count):
    motions = stay(count)
    motions[:, 0, 3] = 2.0 * np.arange(1, count + 1)
    return motions


def into_the_table(count):
    motions = stay(count)
    motions[:, 2, 3] = -0.02
    return motions


def rows_of(results):
    return tuple(result.to_dict() for result in results)


@pytest.fixture(scope="module")
def scenes():
    return list(draw_evaluation_scenes(MODELS, 2, shapes=("line", "tower"), seed=3))


@pytest.mark.parametrize(
    "successes, n, low, high",
    [(0, 10, 0.0, 0.2775), (5, 10, 0.2366, 0.7634), (10, 10, 0.7225, 1.0), (63, 101, 0.5266, 0.7121), (0, 0, 0, 1)],
)
def test_wilson_intervals(successes, n, low, high):
    assert wilson_interval(successes, n) == pytest.approx((low, high), abs=1e-3)


def test_wilson_intervals_hold_the_rate():
    for n in range(1, 60):
        for successes in (0, n // 2, n):
            low, high = wilson_interval(successes, n)
            assert 0 <= low <= successes / n <= high <= 1


def test_wilson_needs_a_count():
    with pytest.raises(ValueError, match="between 0 and n = 3, got 4"):
        wilson_interval(4, 3)


def test_the_reference_succeeds_at_its_rank(scenes):
    scene = scenes[0]
    planner = Prepared(lambda n: [off_the_table(n), scene.drawn.reference_goal_from_initial(), stay(n)])
    named = replace(scene, words="put the things in a line", embedding=np.ones(384, np.float32))
    result = solve(planner, named, top_k=3)
    assert result.failure == "abnormal velocity"
    assert [result.success_at(k) for k in (1, 2, 3)] == [False, True, True]
    assert len(result.verdicts) == 2 and result.proposed == 3  # it stops at the first that stands
    _, goal, _ = planner.seen[0]
    assert (goal.spec, goal.sentence, goal.embedding.shape) == (scene.spec, "put the things in a line", (384,))


def test_rates_and_rows(scenes):
    planner = Prepared(lambda n: [off_the_table(n)])
    results = [solve(planner, scene, top_k=2) for scene in scenes]
    seeds = [seed for _, _, seed in planner.seen]
    assert len(set(seeds)) == len(seeds)
    again = [solve(planner, scene, top_k=2) for scene in scenes]
    assert [seed for _, _, seed in planner.seen] == seeds + seeds
    assert [r.verdicts[0].detail for r in results] == [r.verdicts[0].detail for r in again]

    report = json.loads(json.dumps(Evaluation(rows_of(results), 2, {"model": "prepared", "seed": 3}).to_dict()))
    assert report["schema"] == "structagent-success/3" and report["about"]["model"] == "prepared"
    assert set(report["aggregate"]) == {"line", "tower", "all"}
    every = report["aggregate"]["all"]
    assert every["n"] == 4 and every["success"]["count"] == 0
    assert every["failures"]["abnormal velocity"] == {
        "count": 4,
        "rate": 1.0,
        "low": pytest.approx(0.5101, abs=1e-3),
        "high": pytest.approx(1.0),
    }
    row = report["scenes"][0]
    assert row["structure"] == "line" and row["failure"] == "abnormal velocity" and not row["success"]
    assert row["first_success_rank"] is None and row["verdicts"][0]["measured"]["speed"] > 1
    assert row["seconds"] >= row["plan_seconds"] >= 0


def test_a_planner_that_gives_up_is_counted(scenes):
    def give_up(count):
        raise LayoutError("it does not fit")

    result = solve(Prepared(give_up), scenes[0])
    assert (result.failure, result.problem, result.verdicts) == (NO_ARRANGEMENT, "it does not fit", ())
    assert Evaluation(rows_of([result]), 5).aggregate()["line"]["failures"][NO_ARRANGEMENT]["count"] == 1


def test_what_is_left_of_a_failure(scenes):
    scene = scenes[0]
    initial = scene.drawn.world_from_initial[: scene.drawn.count]

    def left(ranks):
        return solve(Prepared(ranks), scene).to_dict()["left"]

    np.testing.assert_allclose(left(lambda n: [into_the_table(n)]), into_the_table(len(initial)) @ initial, atol=1e-6)
    fallen = left(lambda n: [off_the_table(n)])
    assert sum(pose is not None for pose in fallen) == 1  # the first object left the table, the others were not placed
    assert left(lambda n: [scene.drawn.reference_goal_from_initial()]) is None
    assert left(lambda n: []) is None
