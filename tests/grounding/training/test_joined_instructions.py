"""Two labelled instructions of one scene make one, with the label that follows."""

from __future__ import annotations

import numpy as np

from grounding.goal_network.vocabulary import KEYWORD, KEYWORDS, START
from grounding.training.goal_lines import GoalLine
from grounding.training.joined_instructions import JoinedInstructions

CANS = GoalLine("single", "cans and cups", "Stack the cans.", "tower of the cans {0,1,2}.")
CUPS = GoalLine(
    "structure and relation", "cans and cups", "circle of red cup, white cup and yellow cup, blue cup behind the "
                                               "circle",
    "circle of red cup {3} + white cup {5} + yellow cup {4}; place of blue cup {6}, behind structure 1.",
)  # fmt: skip
REMARK = GoalLine("refused", "dinner", "Lovely weather", "nothing.")


def said(task):
    """Return the text of a task, and its label: keywords, and the words at which phrases begin."""
    steps = [
        KEYWORDS[at[0]] if kind == KEYWORD else task.words[at[0]] for kind, at in task.steps if kind in (KEYWORD, START)
    ]
    return " ".join(task.words), " ".join(steps)


def drawn(lines, count=60):
    joined = JoinedInstructions(lines, np.random.default_rng(0))
    return {said(joined.draw()) for _ in range(count)}


def test_a_remark_changes_nothing():
    found = drawn([CANS, REMARK])
    assert {label for _, label in found} == {"tower of the <end>"}
    assert {text for text, _ in found} == {"lovely weather . stack the cans .", "stack the cans . lovely weather"}


def test_two_wishes_follow_each_other_with_their_structures_counted_on():
    labels = {label for text, label in drawn([CANS, CUPS, REMARK]) if "cans" in text and "circle" in text}
    assert "tower of the circle of red white yellow place of blue rel behind structure 2 <end>" in labels
    assert "circle of red white yellow place of blue rel behind structure 1 tower of the <end>" in labels


RED = GoalLine("single", "cans and cups", "Line up the cans.", "line of the cans {0,1,2}.")


def test_wishes_about_the_same_objects_are_not_joined():
    labels = {label for text, label in drawn([CANS, RED, REMARK]) if "stack" in text and "line" in text}
    assert labels == {"tower of the <end>", "line of the <end>"}


def test_a_wish_that_is_taken_back_leaves_the_other_one():
    found = drawn([CANS, RED, REMARK], 200)
    both = {text: label for text, label in found if "stack" in text and "line" in text}
    for text, label in both.items():
        last = "tower" if text.index("stack") > text.index("line up") else "line"
        assert label == f"{last} of the <end>"
    assert any("no , wait , rather line up the cans" in text for text in both)
