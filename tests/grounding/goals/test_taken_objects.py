"""Objects leave the structures that stood, where a later wish puts them elsewhere."""

import pytest

from grounding.goals.taken_objects import without_taken
from tests.grounding.goal_in_words import goal_of_words


@pytest.mark.parametrize(
    ("before", "goal", "left"),
    [
        ("square of 0, 1, 2, 3", "square of 0, 1, 2, 3; 3 at bottom center", "square of 0, 1, 2; 3 at bottom center"),
        ("line of 0, 1, 2", "line of 0, 1, 2; 3 behind part 1", "line of 0, 1, 2; 3 behind part 1"),
        ("line of 0, 1, 2", "line of 0, 1, 2; 1 moved left by 5 cm", "line of 0, 1, 2; 1 moved left by 5 cm"),
        ("nothing", "line of 0, 1, 2; 1 on 4", "line of 0, 1, 2; 1 on 4"),  # said at once: that is a contradiction, or a sequence
        ("structure of 0, 1, left", "structure of 0, 1, left; 0, 1 on 4", "structure of 0, 1, left; 0, 1 on 4"),
    ],
)
def test_objects_leave_what_stood(before, goal, left):
    so_far = goal_of_words(before) if before != "nothing" else goal_of_words("line of 8, 9")
    assert str(without_taken(goal_of_words(goal), so_far)) == str(goal_of_words(left))
