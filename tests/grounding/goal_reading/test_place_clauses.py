"""Objects are found by the clause of place after their noun, by colours as nouns, and as those that are left."""

from __future__ import annotations

import pytest

from grounding.goal_reading.reader import GoalReader
from grounding.references.attributes import ObjectAttributes, SceneObject


def cup(color: str, x: float, y: float) -> SceneObject:
    return SceneObject("cup", ObjectAttributes((color,), (0.08, 0.08, 0.09), (x, y)))


SCENE = [
    cup("red", 0.25, -0.3), cup("red", 0.28, 0.0), cup("red", 0.3, 0.3), cup("blue", 0.48, -0.28), cup("blue", 0.5, 0.15),
    SceneObject("bowl", ObjectAttributes(("white",), (0.18, 0.18, 0.07), (0.62, 0.3))),
]  # fmt: skip


def chosen(text: str) -> tuple[int, ...]:
    reading = GoalReader().read(text, SCENE)
    assert reading.complete, (reading.problem, reading.residue, reading.question)
    return reading.goal.parts[0].objects


@pytest.mark.parametrize(
    ("phrase", "indices"),
    [
        ("the cup nearest to me", (0,)), ("the cup that is farthest from me", (4,)), ("the cup closest to the bowl", (4,)),
        ("the red cup that's furthest away from the bowl", (0,)), ("the leftmost cup", (2,)), ("the middle red cup", (1,)),
        ("the second red cup from the left", (1,)), ("the cup that is furthest to the right", (0,)), ("the reds", (0, 1, 2)),
        ("the two blues", (3, 4)), ("the three cups closest to me", (0, 1, 2)),
    ],
)  # fmt: skip
def test_phrases(phrase, indices):
    assert tuple(sorted(chosen(f"put {phrase} in front of the bowl"))) == indices


def test_the_middle_of_the_table_is_the_robots_for_the_one_across():
    opposite = GoalReader(opposite=True)
    assert opposite.read("put the cup nearest to me behind the bowl", SCENE).goal.parts[0].objects == (4,)
    assert opposite.read("put the cup nearest to the robot behind the bowl", SCENE).goal.parts[0].objects == (0,)


def test_the_other_three_are_of_the_same_kind():
    parts = GoalReader().read("stack the blue cups and put the other three in a row", SCENE).goal.parts
    assert [part.objects for part in parts] == [(3, 4), (0, 1, 2)]


def test_another_number_of_others_is_refused():
    assert "4" in GoalReader().read("stack the blue cups and put the other seven in a row", SCENE).problem


@pytest.mark.parametrize(
    "text", ["put all cups in a row but not the red ones", "all cups in a row, the red ones excluded, behind the bowl"]
)
def test_exceptions(text):
    assert chosen(text) == (3, 4)


def test_a_clause_that_nothing_can_judge_is_not_passed_over():
    assert not GoalReader().read("put the cups that are broken behind the bowl", SCENE).complete
