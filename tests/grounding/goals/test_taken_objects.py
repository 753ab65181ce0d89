"""Objects leave the structures that stood, where a later wish puts them elsewhere."""

import pytest

from grounding.goals.goal import Goal
from grounding.goals.taken_objects import owned_once, without_placed, without_taken
from tests.grounding.goal_in_words import goal_of_words


@pytest.mark.parametrize(
    ("before", "goal", "left"),
    [
        ("square of 0, 1, 2, 3", "square of 0, 1, 2, 3; 3 at bottom center", "square of 0, 1, 2; 3 at bottom center"),
        ("line of 0, 1, 2", "line of 0, 1, 2; 3 behind part 1", "line of 0, 1, 2; 3 behind part 1"),
        ("line of 0, 1, 2", "line of 0, 1, 2; 1 moved left by 5 cm", "line of 0, 1, 2; 1 moved left by 5 cm"),
        # Said at once: that is a contradiction, or a sequence
        ("nothing", "line of 0, 1, 2; 1 on 4", "line of 0, 1, 2; 1 on 4"),
        ("structure of 0, 1, left", "structure of 0, 1, left; 0, 1 on 4", "structure of 0, 1, left; 0, 1 on 4"),
    ],
)
def test_objects_leave_what_stood(before, goal, left):
    so_far = goal_of_words(before) if before != "nothing" else goal_of_words("line of 8, 9")
    assert str(without_taken(goal_of_words(goal), so_far)) == str(goal_of_words(left))


@pytest.mark.parametrize(
    ("goal", "taken", "left"),
    [
        ("1 at top; 2 at bottom", {2}, "1 at top"),
        (
            "structure of 2, 3, left; line of 4, 5, 6, right; part 2 behind 0",
            {2, 3},
            "line of 4, 5, 6, right; part 1 behind 0",
        ),
        # Another part refers to it
        ("line of 0, 1, 2; 3 behind part 1", {0, 1, 2}, "line of 0, 1, 2; 3 behind part 1"),
        ("square of 0, 1, 2, 3", {3}, "square of 0, 1, 2"),
    ],
)
def test_a_goal_without_what_it_does_to_some_objects(goal, taken, left):
    assert str(without_placed(goal_of_words(goal), taken)) == str(goal_of_words(left))


@pytest.mark.parametrize(
    ("before", "said", "left"),
    [
        ("line of 0, 1, 2; circle of 3, 4, 5, 6", "line of 0, 1, 2, 6; circle of 3, 4, 5, 6",
         "line of 0, 1, 2, 6; circle of 3, 4, 5"),
        ("line of 0, 1, 2; circle of 3, 4, 5, 6", "tower of 0, 7; line of 0, 1, 2; circle of 3, 4, 5, 6",
         "tower of 0, 7; line of 1, 2; circle of 3, 4, 5, 6"),
        ("line of 0, 1; circle of 3, 4, 5", "circle of 3, 4, 5; line of 0, 1, 3, 5", "circle of 4; line of 0, 1, 3, 5"),
        ("line of 0, 1", "line of 0, 1; 1 on 4", "line of 0, 1; 1 on 4"),
    ],
)  # fmt: skip
def test_what_joins_another_structure_leaves_its_own(before, said, left):
    def parts(words):
        return [_part(each) for each in words.split("; ")]

    assert owned_once(parts(said), goal_of_words(before)) == parts(left)


def test_of_two_new_structures_neither_has_a_right_to_an_object():
    both = [_part("line of 0, 1"), _part("tower of 1, 2")]
    assert owned_once(both, Goal()) == both == owned_once(both, goal_of_words("line of 8, 9"))


def _part(words):
    shape, _, objects = words.partition(" of ")
    if not objects:
        return {"kind": "relation", "relation": "on", "objects": [1], "reference": [4]}
    return {"kind": "structure", "shape": shape, "objects": [int(one) for one in objects.split(", ")]}
