"""Test that physics rollouts, which use only clouds, agree with the true objects."""

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import estimate
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.solids import assemble, box, circle_outline, prism, shell
from structdiffusion.observation import Arrangement
from structdiffusion.postprocessing.physics_reranking import rerank_by_physics
from structdiffusion.postprocessing.physics_rollout import PhysicsRollout
from structdiffusion.protocol.physical_stability import place_and_check
from structdiffusion.protocol.release import TabletopBodies
from structdiffusion.simulation.world import TabletopWorld

pytestmark = pytest.mark.usefixtures("one_cache")

TOWER = StructureSpec("tower")
AT = [pose_from_xyz_yaw(0.4, y, 0.0, 0.0) for y in (-0.2, 0.0, 0.2)]


@pytest.fixture(scope="module")
def models():
    """A bowl, a narrow can that goes into it, and a broad block."""
    bowl = [prism(circle_outline(0.06), 0.0, 0.006), *shell([(0.06, 0.0), (0.075, 0.08)], 0.004)]
    parts = {"bowl": bowl, "can": [prism(circle_outline(0.025), 0.0, 0.1)], "block": [box(0.1, 0.1, 0.0, 0.06)]}
    return [
        assemble(name, name, hulls, density=600.0, friction=0.5, color=(0.8, 0.4, 0.2), source="procedural",
                 rng=np.random.default_rng(0))
        for name, hulls in parts.items()
    ]  # fmt: skip


@pytest.fixture(scope="module")
def scene(models):
    with TabletopWorld(models, AT) as world:
        return world.observe(np.random.default_rng(0))


def onto(lower: int, upper: int, height: float, off: float = 0.0) -> np.ndarray:
    """Motions that put one object over another's place, this high, and leave the third where it is."""
    motions = np.tile(np.eye(4), (3, 1, 1))
    motions[upper, :3, 3] = AT[lower][:3, 3] - AT[upper][:3, 3] + (0.0, off, height)
    return motions


def test_what_goes_into_a_vessel_is_let_down(models, scene):
    """The rim is where the camera sees the bowl end: from there the can would fall by 7 cm."""
    rim = estimate(scene.objects[0]).height
    lowered = PhysicsRollout(scene).set_down(onto(0, 1, rim))
    assert 0.006 < lowered[1, 2, 3] < 0.03
    np.testing.assert_array_equal(lowered[[0, 2]], onto(0, 1, rim)[[0, 2]])
    first = place_and_check(TabletopBodies(models[:2], AT[:2]), onto(0, 1, rim)[:2], TOWER)
    second = place_and_check(TabletopBodies(models[:2], AT[:2]), lowered[:2], TOWER)
    assert first.failure == "abnormal velocity" and second.failure != "abnormal velocity"


def test_what_would_be_inside_of_something_is_lifted_out_of_it(models, scene):
    """A block 3 cm deep in the bowl's walls, which are narrower than it."""
    deep = onto(0, 2, estimate(scene.objects[0]).height - 0.03)
    lifted = PhysicsRollout(scene).set_down(deep)
    pair = TabletopBodies([models[0], models[2]], AT[::2])
    before = place_and_check(pair, deep[[0, 2]], TOWER)
    after = place_and_check(pair, lifted[[0, 2]], TOWER)
    assert before.failure == "intersection" and after.success
    np.testing.assert_array_equal(lifted[:2], deep[:2])


def test_what_lands_on_a_level_top_or_on_the_table_stays_where_it_is(models, scene):
    rollout = PhysicsRollout(scene)
    stacked, beside = onto(2, 0, 0.068), np.tile(np.eye(4), (3, 1, 1))
    np.testing.assert_allclose(rollout.set_down(stacked), stacked, atol=0.003)  # the top is known to millimetres
    np.testing.assert_array_equal(rollout.set_down(beside), beside)


def test_the_verdict_of_a_rollout_is_that_of_the_true_objects(models, scene):
    two = scene.select([0, 2])  # the bowl and the block; the can is a distractor
    rollout = PhysicsRollout(two)
    bodies = TabletopBodies([models[0], models[2]], [AT[0], AT[2]], others=[(models[1], AT[1])])
    for height, off, stands in ((0.064, 0.0, True), (0.064, 0.075, False), (0.03, 0.0, False), (0.0, 0.1, False)):
        motions = onto(2, 0, height, off)[[0, 2]]
        true = place_and_check(bodies, motions, TOWER)
        guessed = rollout.verdict(motions, TOWER)
        assert true.success == guessed.success == stands
        assert true.failure == guessed.failure


def test_the_best_are_tried_until_enough_of_them_stand(scene):
    two = scene.select([0, 2])
    good, bad = onto(2, 0, 0.064)[[0, 2]], onto(2, 0, 0.064, 0.075)[[0, 2]]

    def tried(*motions, best=8, lowest=0.5):
        totals = np.linspace(0.9, lowest, len(motions))
        rows = [Arrangement(row, {"total": float(total)}) for row, total in zip(motions, totals)]
        return rerank_by_physics(PhysicsRollout(two), rows, TOWER, best)

    found = tried(bad, good)
    assert [row.scores["rollout"] for row in found] == [1.0, 0.1]
    np.testing.assert_allclose(found[0].goal_from_initial, good, atol=0.003)
    assert [row.scores["total"] for row in found] == pytest.approx([0.5, 0.09])
    # It stands with much room: no other is tried.
    assert [row.scores["rollout"] for row in tried(good, good, good, bad)] == [1.0, 0.5, 0.5, 0.5]
    assert [row.scores["rollout"] for row in tried(bad, good, best=1)] == [0.5, 0.1]
    stood_first = tried(bad, good, lowest=0.01)
    assert [row.scores["total"] for row in stood_first] == pytest.approx([0.01, 0.09])


def test_the_higher_something_stacks_the_more_room_its_goal_leaves_below():
    """What is seen of a top is millimetres lower than its rim: in a stack these errors add up."""
    believed = [_brick(0.05 - missed) for missed in (0.0025, 0.003, 0.0025, 0.0)]
    true = [_brick(0.05)] * 4
    places = [pose_from_xyz_yaw(0.4, 0.2 * k - 0.3, 0.0, 0.0) for k in range(4)]
    with TabletopWorld(true, places) as world:
        seen = world.observe(np.random.default_rng(0))
    motions = np.tile(np.eye(4), (4, 1, 1))
    tops = np.concatenate(([0.0], np.cumsum([model.height for model in believed])))[:4]
    for k, motion in enumerate(motions):
        motion[:3, 3] = (0.0, -0.2 * k, tops[k] + 0.004 * (k > 0))
    lowered = PhysicsRollout(seen, list(zip(believed, places, strict=True))).set_down(motions)
    room = lowered[:, 2, 3] - tops
    assert room[0] == 0.0 and (np.diff(room) > 0.002).all() and room[-1] < 0.0125
    assert place_and_check(TabletopBodies(true, places), lowered, TOWER).success
    assert place_and_check(TabletopBodies(believed, places), lowered, TOWER).success


def _brick(height):
    return assemble("brick", "brick", [box(0.08, 0.08, 0.0, height)], density=600.0, friction=0.5,
                    color=(0.8, 0.4, 0.2),
                    source="procedural", rng=np.random.default_rng(0))  # fmt: skip
