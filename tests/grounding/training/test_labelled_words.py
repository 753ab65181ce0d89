"""The words that labels copy lead to the objects that labels name: what the networks are taught can be built as it was meant."""

from collections import Counter

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.goal_rendition import AfterGoal, rendition_of
from grounding.goal_network.parts import UnreadLengthError, parts_of
from grounding.goal_network.vocabulary import Action
from grounding.goal_network.writer import WrittenGoal
from grounding.goals.comparison import compare_goals
from grounding.propose.proposal import WordedGoal
from grounding.propose.resolution import resolved
from grounding.training.goal_corrections import GoalCorrection, corrected, goal_corrections, goals_of
from grounding.training.goal_lines import LabelError, goal_lines, labelled


def outcome(row, encoder):
    """Return what the words of a label come to: "right", "wrong", "asked", "refused", or "" for a text without a goal."""
    objects = goal_scenes()[row.scene]
    follows = isinstance(row, GoalCorrection)
    try:
        before, goal = goals_of(row)
        if goal is None or not goal.parts:
            return ""
        task = corrected(row) if follows else labelled(row.text, row.label, scene=row.scene)
    except LabelError:
        return ""
    actions = tuple(Action(kind, places[0]) for kind, places in task.steps[:-1])
    rendition = rendition_of(before, objects)
    written = AfterGoal(task.words, actions, 1.0, rendition) if follows else WrittenGoal(task.words, actions, 1.0)
    try:
        read = parts_of(written, " ".join(task.words) if follows else row.text)
    except UnreadLengthError:
        return "refused"
    known, about = (rendition.known, rendition.text) if follows else ({}, "")
    worded = WordedGoal(1.0, read.parts, read.kept, read.answer, known=known, before=before, about=about)
    found = resolved(worded, row.text, objects, encoder)
    if found.question is not None:
        return "asked"
    if found.goal is None or found.problem:
        return "refused"
    return "right" if compare_goals(found.goal, goal, len(objects)).exact else "wrong"


# Of texts with a goal the least share that is right, and the greatest share that is another goal.
@pytest.mark.parametrize(
    ("rows", "right", "wrong"),
    [(goal_lines()[::47], 0.93, 0.01), (goal_corrections()[::47], 0.95, 0.01)],
    ids=["instructions", "follow-ups"],
)
def test_labelled_words_mean_the_labelled_goal(encoder, rows, right, wrong):
    found = Counter(filter(None, (outcome(row, encoder) for row in rows)))
    print(dict(found))
    assert sum(found.values()) > 0.7 * len(rows)
    assert found["right"] >= right * sum(found.values()) and found["wrong"] <= wrong * sum(found.values()), found
