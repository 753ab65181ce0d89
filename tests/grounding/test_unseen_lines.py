"""Instructions of people who knew the guide of labels alone: how many are read rightly,
asked about and built otherwise.
"""

from collections import Counter
from pathlib import Path

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.vocabulary import NO_GOAL
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.training.goal_corrections import goal_of

ROWS = [
    line.split("\t")
    for line in Path(__file__).with_name("unseen_lines.tsv").read_text("utf-8").splitlines()
    if not line.startswith("#")
]


def outcome(interpreter, scene, text, label):
    objects = goal_scenes()[scene]
    found = interpreter.interpret(text, objects)
    if found.status != "ok":
        return found.status
    if label.strip(" .") in NO_GOAL:
        return "wrong"
    return "right" if compare_goals(found.goal, goal_of(label, len(objects)), len(objects)).exact else "wrong"


def test_rates(interpreter):
    interpreter.read_ahead([(text, goal_scenes()[scene], Goal()) for _, scene, text, _ in ROWS])
    wished = Counter(outcome(interpreter, *row) for _, *row in ROWS if row[-1].strip(" .") not in NO_GOAL)
    others = Counter(outcome(interpreter, *row) for _, *row in ROWS if row[-1].strip(" .") in NO_GOAL)
    print(wished, others)
    assert (sum(wished.values()), sum(others.values())) == (96, 24)
    assert wished["right"] >= 92 and wished["wrong"] <= 1 and others["wrong"] <= 1, (wished, others)
