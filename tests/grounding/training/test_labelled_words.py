"""The words that labels copy lead to the objects that labels name: what the networks are taught can
be built as it was meant.
"""

from collections import Counter

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.parts import UnreadLengthError
from grounding.goals.comparison import compare_goals
from grounding.goals.part_numbers import laid_around
from grounding.training.goal_corrections import GoalCorrection, goal_corrections, goals_of
from grounding.training.goal_lines import LabelError, goal_lines
from tests.grounding.labelled_words import resolved_label


def outcome(row, encoder):
    """Return what the words of a label come to: "right", "wrong", "asked", "refused",
    or "" for a text without a goal.
    """
    try:
        _, goal = goals_of(row)
        if goal is None or not goal.parts:
            return ""
        found = resolved_label(row, encoder)
    except LabelError:
        return ""
    except UnreadLengthError:
        return "refused"
    if found.question is not None:
        return "asked"
    if found.goal is None or found.problem:
        return "refused"
    count = len(goal_scenes()[row.scene])  # "inside the ring" is said of what a ring is laid around
    return "right" if compare_goals(found.goal, laid_around(goal), count).exact else "wrong"


# Of texts with a goal the least share that is right, and the greatest share that is another goal.
@pytest.mark.parametrize(
    ("read", "right", "wrong"),
    [(goal_lines, 0.935, 0.01), (goal_corrections, 0.96, 0.01)],
    ids=["instructions", "follow-ups"],
)
def test_labelled_words_mean_the_labelled_goal(encoder, read, right, wrong):
    rows = read()[::47]  # not among the parameters: every test process would read all of them
    found = Counter(filter(None, (outcome(row, encoder) for row in rows)))
    print(dict(found))
    assert sum(found.values()) > 0.7 * len(rows)
    assert found["right"] >= right * sum(found.values()) and found["wrong"] <= wrong * sum(found.values()), found


@pytest.mark.parametrize(
    ("scene", "before", "text", "after"),
    [
        ("shapes", "place of yellow cylinder {4}, in front of the brick {5}.", "Sorry, the other cylinder.",
         "place of the other cylinder {3}, in front of the brick {5}."),
        ("breakfast", "place of the red mug {0}, left of the plate {3}.", "no, the other one",
         "place of the other one {1}, left of the plate {3}."),
        ("garden", "place of the smaller brown pot {1}, behind the stone {5}.", "bigger one",
         "place of bigger one {0}, behind the stone {5}."),
        ("cans and cups", "circle of the cups {3,4,5,6}; place of the green can {2}, at right top.",
         "the can at left top",
         "circle of the cups {3,4,5,6}; place of the can {2}, at left top."),
        ("cans and cups", "pyramid of the cups {3,4,5}, right.", "add the blue one",
         "pyramid of the cups {3,4,5} + the blue one {6}, right."),
    ],
)  # fmt: skip
def test_words_of_a_follow_up_take_their_meaning_from_the_goal_so_far(encoder, scene, before, text, after):
    assert outcome(GoalCorrection(scene, before, text, after), encoder) == "right"
