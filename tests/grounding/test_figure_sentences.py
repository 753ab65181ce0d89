"""Sentences of strangers about figures: how many are read rightly, asked about, refused, and built otherwise."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from grounding.figures.names import VARIABLE
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.goals.parts import PartReference, RelationPart, StructurePart

KINDS = {
    "few": {"block": 5}, "blocks": {"block": 12}, "cans": {"can": 10, "cup": 2, "banana": 1},
    "shop": {"can": 10, "box": 6, "bottle": 5, "bowl": 1},
    "kids": {"cube": 10, "marker": 6, "star": 1, "heart": 1, "toy house": 1, "mug": 1},
    "lab": {"vial": 8, "beaker": 4, "tube": 6},
}  # fmt: skip
ROWS = [
    line.split("\t")
    for line in Path(__file__).with_name("figure_sentences.tsv").read_text("utf-8").splitlines()
    if not line.startswith("#")
]


def names_of(scene):
    return [f"{kind} {k + 1}" if count > 1 else kind for kind, count in KINDS[scene].items() for k in range(count)]


def indices(text):
    spans = [span.partition("-") for span in text.split(",")]
    return None if text == "*" else tuple(i for a, _, b in spans for i in range(int(a), int(b or a) + 1))


def goal_of(label):
    """Return the goal of a label; "6 of 0-11" are the first six of these, and a rotation of "?" is left open."""
    parts = []
    for one in filter(None, label.split(" ; ")):
        head, *cells = one.split("|")
        if head == "rel":
            objects, reference = (PartReference(int(c[4:])) if c.startswith("part") else indices(c) for c in cells[1:])
            parts.append(RelationPart(cells[0], objects, reference))
            continue
        slots = dict(pair.split("=") for pair in cells[1].split(",")) if len(cells) > 1 else {}
        slots = {slot: value for slot, value in slots.items() if value != "?"}
        count, _, those = cells[0].rpartition(" of ")
        objects = indices(those)[: int(count)] if count else indices(those)
        parts.append(
            RelationPart("at", objects, **slots) if head == "at" else StructurePart(head, objects=objects, **slots)
        )
    return Goal(tuple(parts))


def as_meant(goal, label):
    """Return a goal with what the label leaves open as the label has it: which six of the blocks,
    which way it faces.
    """
    wanted = goal_of(label)
    if not goal.structures or not wanted.structures:
        return goal
    first = goal.structures[0]
    if " of " in label and first.objects is not None and len(first.objects) == len(wanted.structures[0].objects):
        first = replace(first, objects=wanted.structures[0].objects)
    return Goal((replace(first, rotation=None) if "rotation=?" in label else first, *goal.parts[1:]))


def outcome(interpreter, scene, before, text, label):
    names = names_of(scene)
    found = interpreter.interpret(text, names, goal_of(before))
    if found.status != "ok":
        return "right" if label == "REFUSED" else found.status
    if label != "REFUSED" and compare_goals(as_meant(found.goal, label), goal_of(label), len(names)).exact:
        return "right"
    return "wrong" if found.message else "wrong in silence"


@pytest.mark.parametrize(("half", "count", "right", "silent"), [("seen", 38, 31, 1), ("unseen", 36, 31, 1)])
def test_rates(interpreter, monkeypatch, tmp_path, half, count, right, silent):
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    found = Counter(outcome(interpreter, *row) for own, *row in ROWS if own == half)
    print(found)
    assert sum(found.values()) == count
    assert found["right"] >= right and found["wrong in silence"] <= silent and found["wrong"] <= 1, found
