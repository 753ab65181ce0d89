"""Single corrections by writers whose rows neither rules nor networks were made with: how many are read, asked, built
wrongly.

The form of `unseen_corrections.tsv` (writer 1) and `unseen_corrections_b.tsv` (writer 3) is that of
`grounding/language/goal_corrections.tsv.xz`. Nobody opens them; rates only. Writer 4 labelled 130 before any was read:
with `seen_corrections_d.tsv` corrections were developed, `unseen_corrections_d.tsv` is read by nobody. Writer 5
(`unseen_corrections_e.tsv`) and writer 6 (`unseen_corrections_f.tsv`) wrote what people would naturally type; labels
that are equally fair are divided by "||". Writers 7 and 8 (`unseen_corrections_g.tsv`, `unseen_corrections_h.tsv`)
spoke as ten and twelve people, and mixed remarks in.
"""

from __future__ import annotations

import csv
from collections import Counter
from pathlib import Path

import pytest

from grounding.dialogue.state import Dialogue
from grounding.dialogue.turns import say
from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.vocabulary import NO_GOAL
from grounding.goals.comparison import compare_goals
from grounding.training.goal_corrections import GoalCorrection, goal_of
from tests.grounding.side_by_side import side_by_side


def rows_of(file):
    lines = Path(__file__).with_name(file).read_text(encoding="utf-8").splitlines()
    rows = [GoalCorrection(*row) for row in csv.reader(lines, delimiter="\t", quoting=csv.QUOTE_NONE)]
    return [row for row in rows if row.after != "computed."]  # what "5 cm more" comes to has no label


def outcome(reader, row):
    """Say a correction; return whether it is "right", "offered" among the answers of a question, "wrong",
    "asked" or "refused".
    """
    objects = goal_scenes()[row.scene]
    before = goal_of(row.before, len(objects))
    labels = (label.strip(" .") for label in row.after.split("||"))
    wanted = [goal_of(label, len(objects)) for label in labels if label not in NO_GOAL]

    def right(goal):
        return any(compare_goals(goal, one, len(objects)).exact for one in wanted)

    yield Dialogue(before), row.text, objects, ()
    state, found = say(Dialogue(before), row.text, reader, objects)
    if found.status == "ok":
        return "right" if right(found.goal) else "wrong"
    if found.status == "unchanged":
        return "right" if right(before) else "refused"
    if found.status != "ask":
        return "refused"
    return "offered" if any(map(right, state.choices)) else "asked"


# Of each file: its rows with a goal and without one; of those at least so many right, and so many right or offered; at
# most so many built otherwise; and at most so many of the others built.
RATES = [
    ("unseen_corrections.tsv", (217, 72), 124, 174, 13, 2),
    ("unseen_corrections_b.tsv", (194, 74), 137, 166, 8, 4),
    ("unseen_corrections_d.tsv", (62, 3), 35, 52, 4, 1),
    ("seen_corrections_d.tsv", (62, 3), 38, 52, 3, 1),
    ("unseen_corrections_e.tsv", (105, 21), 84, 97, 4, 1),
    ("unseen_corrections_f.tsv", (103, 13), 84, 94, 3, 1),
    ("unseen_corrections_g.tsv", (117, 35), 98, 108, 2, 1),
    ("unseen_corrections_h.tsv", (116, 35), 101, 109, 3, 3),
]


@pytest.mark.parametrize(("file", "counts", "right", "with_an_answer", "wrong", "wrong_others"), RATES)
def test_rates(interpreter, file, counts, right, with_an_answer, wrong, wrong_others):
    rows = rows_of(file)
    found = side_by_side(interpreter, lambda reader: [outcome(reader, row) for row in rows])
    goals, others = Counter(), Counter()
    for row, each in zip(rows, found, strict=True):
        (others if row.after.strip(" .") in NO_GOAL else goals)[each] += 1
    print(file, dict(goals), dict(others))
    assert (sum(goals.values()), sum(others.values())) == counts
    assert goals["right"] >= right and goals["right"] + goals["offered"] >= with_an_answer, goals
    assert goals["wrong"] <= wrong and others["wrong"] <= wrong_others, (goals, others)
