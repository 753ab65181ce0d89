"""Single corrections by writers whose rows neither rules nor networks were made with: how many are read, asked, built wrongly.

The form of `unseen_corrections.tsv` (writer 1) and `unseen_corrections_b.tsv` (writer 3) is that of
`grounding/language/goal_corrections.tsv`. Nobody opens them; rates only. Writer 4 labelled 130 before any was read: with
`seen_corrections_d.tsv` corrections were developed, `unseen_corrections_d.tsv` is read by nobody. Writer 5
(`unseen_corrections_e.tsv`) and writer 6 (`unseen_corrections_f.tsv`) wrote what people would naturally type; labels that
are equally fair are divided by "||".
"""

from __future__ import annotations

import csv
from collections import Counter
from pathlib import Path

import pytest

from grounding.dialogue.scene_reader import SceneReader
from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.vocabulary import NO_GOAL
from grounding.goal_network.writer import CORRECTIONS, NetworkWriter
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.interpreter import Interpreter
from grounding.training.goal_corrections import GoalCorrection, goal_of
from tests.grounding.dialogue.test_goal_dialogues import turn_of


def rows_of(file):
    lines = Path(__file__).with_name(file).read_text(encoding="utf-8").splitlines()
    rows = [GoalCorrection(*row) for row in csv.reader(lines, delimiter="\t", quoting=csv.QUOTE_NONE)]
    return [row for row in rows if row.after != "computed."]  # what "5 cm more" comes to has no label


@pytest.fixture(scope="module")
def interpreter(parser, encoder):
    return Interpreter(
        lambda: parser, None, "robot", encoder, network=lambda: NetworkWriter.from_pretrained(encoder),
        corrector=lambda: NetworkWriter.from_pretrained(encoder, CORRECTIONS),
    )  # fmt: skip


def outcome(interpreter, encoder, row):
    """Return whether a correction is "right", "offered" among the answers of a question, "wrong", "asked" or "refused"."""
    objects = goal_scenes()[row.scene]
    before = goal_of(row.before, len(objects))
    labels = (label.strip(" .") for label in row.after.split("||"))
    wanted = [goal_of(label, len(objects)) for label in labels if label not in NO_GOAL]

    def same(one, other):
        return compare_goals(one, other, len(objects)).exact

    status, then, choices = turn_of(SceneReader(interpreter, objects), encoder, before, row.text, objects)
    if status == "ok":
        return "right" if any(same(then, one) for one in wanted) else "refused" if same(then, before) else "wrong"
    if status != "ask":
        return "refused"
    offered = any(isinstance(one, Goal) and same(one, goal) for one in choices for goal in wanted)
    return "offered" if offered else "asked"


@pytest.mark.parametrize(
    ("file", "counts", "right", "with_an_answer", "wrong", "wrong_others"),
    [
        # Before the labelled texts of the last fourteen writers: 62 right, 136 with an answer, 10 wrong, 1 of the others.
        ("unseen_corrections.tsv", (217, 72), 66, 138, 11, 2),
        # Before them: 111, 158, 9 and 3.
        ("unseen_corrections_b.tsv", (194, 74), 114, 162, 9, 3),
        # Before them: 35, 47, 7 and 0; 40, 51, 2 and 0 of the seen ones.
        ("unseen_corrections_d.tsv", (62, 3), 36, 47, 6, 0),
        ("seen_corrections_d.tsv", (62, 3), 40, 51, 4, 0),
        # Before them: 88, 96, 2 and 0.
        ("unseen_corrections_e.tsv", (105, 21), 89, 97, 1, 1),
        # Before them: 71, 89, 3 and 0.
        ("unseen_corrections_f.tsv", (103, 13), 71, 90, 3, 0),
    ],
)
def test_rates(interpreter, encoder, file, counts, right, with_an_answer, wrong, wrong_others):
    rows = rows_of(file)
    goals = Counter(outcome(interpreter, encoder, row) for row in rows if row.after.strip(" .") not in NO_GOAL)
    others = Counter(outcome(interpreter, encoder, row) for row in rows if row.after.strip(" .") in NO_GOAL)
    assert (sum(goals.values()), sum(others.values())) == counts
    assert goals["right"] >= right and goals["right"] + goals["offered"] >= with_an_answer, goals
    assert goals["wrong"] <= wrong and others["wrong"] <= wrong_others and others["right"] == 0, (goals, others)
