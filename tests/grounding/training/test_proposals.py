"""Proposals for labelled texts are written, read again, and completed where they were stopped."""

import json

from grounding.training import proposals
from grounding.training.goal_corrections import GoalCorrection
from grounding.training.goal_lines import GoalLine
from grounding.training.proposals import read_proposals, write_proposals

SCENE = "cans and cups"
ROWS = (
    GoalLine("x", SCENE, "stack the cans on the left", "tower of the cans {0,1,2}, left."),
    GoalLine("x", SCENE, "what a day", "nothing."),
    GoalLine("x", SCENE, "the cans", "heap of the cans {0,1,2}."),
    GoalCorrection(SCENE, "tower of the cans {0,1,2}, left.", "no, on the right", "tower of the cans {0,1,2}, right."),
)


def test_proposals_are_written_and_read(tmp_path):
    told = []
    write_proposals(tmp_path / "all.jsonl", None, told.append, ROWS)
    stack, nothing, correction = read_proposals(tmp_path / "all.jsonl")  # what is no label is left out
    assert told == ["goals proposed for 3 of 3 texts"]
    assert stack.goal in stack.goals and str(stack.goal) == "tower of 0, 1, 2, left"
    assert nothing.goal is None and nothing.before.parts == ()
    assert correction.before == stack.goal and correction.goal in correction.goals


def test_a_stopped_file_is_completed(tmp_path, monkeypatch):
    monkeypatch.setattr(proposals, "WRITTEN", 1)
    path = tmp_path / "some.jsonl"
    write_proposals(path, rows=ROWS[:1])
    first = path.read_text()
    write_proposals(path, rows=ROWS[:2])
    assert path.read_text().startswith(first)
    assert [json.loads(line)["text"] for line in path.read_text().splitlines()] == [row.text for row in ROWS[:2]]
