"""Test the order of the physics rollouts, when they end, and their scores; test_physics_rollout tests the physics."""

from types import SimpleNamespace

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.observation import Arrangement
from structdiffusion.postprocessing.physics_reranking import ENOUGH, MOST, rerank_by_physics
from structdiffusion.postprocessing.physics_rollout import HYPOTHESES

TOWER = StructureSpec("tower")
CALM = {"speed": 0.8, "tilt": 0.0, "displacement": 0.0}
CLOSE = {"speed": 0.8, "tilt": 0.1, "displacement": 0.0}  # it stands, but another may stand more surely


def tower(*bottom_up: int, total: float = 0.5, at: float = 0.0) -> Arrangement:
    motions = np.tile(np.eye(4), (len(bottom_up), 1, 1))
    for level, number in enumerate(bottom_up):
        motions[number, 2, 3] = 0.05 * level
        motions[number, 0, 3] = at
    return Arrangement(motions, {"total": total})


class Fancied:
    """A physics rollout whose verdicts are given by a function of the motions and the hypothesis."""

    def __init__(self, measured) -> None:
        self.measured, self.asked = measured, []

    def set_down(self, motions):
        return motions

    def verdict(self, motions, spec, hypothesis=0):
        self.asked.append((motions, hypothesis))
        found = self.measured(motions, hypothesis)
        return SimpleNamespace(success=found is not None, measured=found)


def test_what_stands_under_every_hypothesis_comes_first():
    doubtful, sure = tower(0, 1, total=0.9, at=0.1), tower(0, 1, total=0.2, at=0.2)
    fancied = Fancied(lambda motions, number: CALM if motions[0, 0, 3] == 0.2 or number < 2 else None)
    found = rerank_by_physics(fancied, [doubtful, sure], TOWER, 8)
    assert [row.goal_from_initial[0, 0, 3] for row in found] == [0.2, 0.1]
    assert [row.scores["rollout"] for row in found] == pytest.approx([1.0, 2 / HYPOTHESES])
    assert found[1].scores["total"] == pytest.approx(0.9 * 2 / HYPOTHESES)


def test_among_those_that_stand_the_one_far_from_the_limits_comes_first():
    close, far = tower(0, 1, total=0.9, at=0.1), tower(0, 1, total=0.2, at=0.2)
    fancied = Fancied(lambda motions, number: {**CALM, "tilt": 0.2 if motions[0, 0, 3] == 0.1 else 0.01})
    assert [row.goal_from_initial[0, 0, 3] for row in rerank_by_physics(fancied, [close, far], TOWER, 8)] == [0.2, 0.1]


def test_what_moves_while_others_are_released_costs_score_although_it_stands_in_the_end():
    calm, shaken = tower(0, 1, total=0.5, at=0.1), tower(0, 1, total=0.9, at=0.2)
    fancied = Fancied(lambda motions, number: {**CALM, "disturbed": 0.05 if motions[0, 0, 3] == 0.1 else 0.55})
    found = rerank_by_physics(fancied, [shaken, calm], TOWER, 8, sure=2.0)
    assert [row.scores["rollout"] for row in found] == pytest.approx([1.0, 0.5])
    assert [row.scores["total"] for row in found] == pytest.approx([0.5, 0.45])


def test_another_order_is_tried_after_one_that_falls_again_and_again():
    same = [tower(0, 1, 2, total=0.9 - 0.01 * k, at=k) for k in range(12)]
    other = tower(1, 0, 2, total=0.3, at=99)
    fancied = Fancied(lambda motions, number: CALM if motions[0, 0, 3] == 99 else None)
    found = rerank_by_physics(fancied, [*same, other], TOWER, 6)
    assert found[0].goal_from_initial[0, 0, 3] == 99 and found[0].scores["rollout"] == 1.0
    tried = [motions[0, 0, 3] for motions, number in fancied.asked if number == 0]
    assert tried[:3] == [0, 1, 2] and 99 in tried


def test_trying_ends_when_enough_stand_or_enough_was_tried():
    rows = [tower(0, 1, total=0.9, at=k) for k in range(50)]
    stands = Fancied(lambda motions, number: CLOSE)
    assert [row.scores["rollout"] for row in rerank_by_physics(stands, rows, TOWER, 16)[: ENOUGH + 1]] == [
        1.0
    ] * ENOUGH + [0.5]
    assert len(stands.asked) == ENOUGH * HYPOTHESES
    falls = Fancied(lambda motions, number: None)
    found = rerank_by_physics(falls, rows, TOWER, 16)
    assert len(falls.asked) == 16  # what falls as guessed is not tried otherwise
    assert [row.scores["rollout"] for row in found].count(0.1) == 16
    unsure = Fancied(lambda motions, number: CALM if number < 3 else None)
    rerank_by_physics(unsure, rows, TOWER, 50)
    released = 2 * len(unsure.asked)
    assert MOST <= released < MOST + 2 * HYPOTHESES < 2 * 50 * HYPOTHESES


def test_one_that_stands_with_much_room_under_every_hypothesis_is_enough():
    rows = [tower(0, 1, total=0.9 - 0.01 * k, at=k) for k in range(6)]
    fancied = Fancied(lambda motions, number: CALM if motions[0, 0, 3] == 1 else CLOSE)
    found = rerank_by_physics(fancied, rows, TOWER, 16)
    assert found[0].goal_from_initial[0, 0, 3] == 1
    assert len(fancied.asked) == 2 * HYPOTHESES
    never = Fancied(lambda motions, number: CALM)
    rerank_by_physics(never, rows, TOWER, 16, sure=2.0)
    assert len(never.asked) == ENOUGH * HYPOTHESES


def test_what_stands_on_the_table_is_tried_once():
    flat = [Arrangement(np.tile(np.eye(4), (3, 1, 1)), {"total": total}) for total in (0.9, 0.8)]
    fancied = Fancied(lambda motions, number: CALM)
    found = rerank_by_physics(fancied, flat, StructureSpec("line"), 8)
    assert [number for _, number in fancied.asked] == [0, 0]
    assert [row.scores["total"] for row in found] == [0.9, 0.8]


def flat(at: float, total: float) -> Arrangement:
    motions = np.tile(np.eye(4), (3, 1, 1))
    motions[:, 0, 3] = at
    return Arrangement(motions, {"total": total})


def test_where_all_on_the_table_falls_trying_ends_and_the_total_decides():
    rows = [flat(at, 0.9 - 0.01 * at) for at in range(20)]
    fancied = Fancied(lambda motions, number: None)
    found = rerank_by_physics(fancied, rows, StructureSpec("line"), 16)
    assert len(fancied.asked) == 8
    assert [row.goal_from_initial[0, 0, 3] for row in found] == list(range(20))
    assert {row.scores["rollout"] for row in found} == {0.1}


def test_one_that_stands_is_looked_for_beyond_the_first_that_fall():
    rows = [flat(at, 0.9 - 0.01 * at) for at in range(20)]
    fancied = Fancied(lambda motions, number: CALM if motions[0, 0, 3] in (7, 15) else None)
    found = rerank_by_physics(fancied, rows, StructureSpec("line"), 16)
    assert len(fancied.asked) == 16
    assert [row.goal_from_initial[0, 0, 3] for row in found[:2]] == [7, 15]


def test_a_tower_is_tried_after_everything_on_the_table_fell():
    rows = [flat(at, 0.9 - 0.01 * at) for at in range(12)] + [tower(0, 1, 2, total=0.1, at=99)]
    fancied = Fancied(lambda motions, number: CALM if motions[0, 0, 3] == 99 else None)
    found = rerank_by_physics(fancied, rows, StructureSpec(x_position="left"), 16)
    assert found[0].goal_from_initial[0, 0, 3] == 99 and found[0].scores["rollout"] == 1.0
    assert len(fancied.asked) == 8 + HYPOTHESES
