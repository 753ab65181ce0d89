"""Conversations of two to four turns about goals: what stands after each turn, or that a question or a refusal comes.

`goal_dialogues.jsonl` has two pairs of sets. The first: 40 dialogues with which corrections were developed, and 20 that were
read for the first time when that was done (then 10 of the 20 came out right in every turn). The second, of another day: 25 that
were mended (12 right at first), and 16 that were read for the first time after that (then 7 right). "unseen c" and
"unseen d" are 40 dialogues each of two writers who knew nothing of the rules, "unseen e" are 30 of a third; nobody opens
them, rates only. A dialogue ends at its first turn that goes wrong.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from grounding.dialogue.revise_goal import revise_goal
from grounding.dialogue.scene_reader import SceneReader
from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.writer import CORRECTIONS, NetworkWriter
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.interpreter import Interpreter
from grounding.references.selection import SelectionError, select_objects

DIALOGUES = [json.loads(line) for line in Path(__file__).with_name("goal_dialogues.jsonl").open(encoding="utf-8")]


@pytest.fixture(scope="module")
def interpreter(parser, encoder):
    return Interpreter(
        lambda: parser, None, "robot", encoder, network=lambda: NetworkWriter.from_pretrained(encoder),
        corrector=lambda: NetworkWriter.from_pretrained(encoder, CORRECTIONS),
    )  # fmt: skip


def turn(interpreter, encoder, goal, text, objects):
    """Return (status, goal) after a sentence; one plain structure gets the objects that its revision speaks of."""
    return turn_of(SceneReader(interpreter, objects), encoder, goal, text, objects)[:2]


def turn_of(reader, encoder, goal, text, objects):
    """Return (status, goal, goals to choose from) after a sentence; see `turn`."""
    found = revise_goal(goal, text, reader, objects, encoder=encoder)
    return *_after(found, reader, encoder, goal, text, objects), found.choices


def _after(found, reader, encoder, goal, text, objects):
    if found.plain is None or found.status != "ok":
        return found.status, found.goal
    plain = found.plain
    if plain.kind == "new":
        read = reader.read(text)
        return read.status, read.goal
    own = goal.parts[0].objects
    own = list(range(len(objects)) if own is None else own)

    def chosen(words):
        return list(select_objects(words, objects, encoder).indices)

    try:
        if plain.objects_how == "add":
            own = sorted({*own, *chosen(plain.objects_text)})
        elif plain.objects_how == "remove":
            own = [index for index in own if index not in chosen(plain.objects_text)]
        elif plain.objects_how == "replace":
            own = chosen(plain.objects_text)
        elif plain.objects_how in ("exchange", "swap"):
            gone = chosen(plain.objects_out_text) if plain.objects_out_text else own
            own = sorted({*(index for index in own if index not in gone), *chosen(plain.objects_text)})
    except SelectionError:
        return "refused", goal
    return ("ok", Goal((StructurePart.of(plain.spec, own),))) if own else ("refused", goal)


def parts_of(said):
    """Return the parts of a goal in words, sorted, the objects of each in the order of the table."""

    def in_order(match):
        return match[1] + ", ".join(sorted(match[2].split(", "), key=int))

    return sorted(re.sub(r"^((?:[a-z ]+ of )?)(\d+(?:, \d+)+)", in_order, part.strip()) for part in said.split(";"))


def outcome(interpreter, encoder, dialogue):
    """Return whether all turns came out right, how many questions were answered before it ended, and whether it ended
    with something else built. A question is answered with the right goal where that is one of its answers.
    """
    goal, objects, answered = Goal(), goal_scenes()[dialogue["scene"]], 0
    for each in dialogue["turns"]:
        status, then, choices = turn_of(SceneReader(interpreter, objects), encoder, goal, each["say"], objects)
        refused = status in ("refused", "unchanged", "ask") and "refused" in each["then"]
        asked = status == "ask" and "ask" in each["then"]
        if status == "ask" and not (refused or asked):
            answers = [one for one in choices if isinstance(one, Goal) and _is(one, each["then"])]
            status, then = ("ok", answers[0]) if answers else (status, then)
            answered += bool(answers)
        if not (refused or asked or (status == "ok" and _is(then, each["then"]))):
            return False, answered, status == "ok"
        goal = then if status == "ok" else goal
    return True, answered, False


def _is(goal, expected):
    return any(parts_of(str(goal)) == parts_of(each) for each in expected)


@pytest.mark.parametrize(
    ("name", "least", "answered", "wrong"),
    [
        ("development", 39, 39, 0), ("unseen", 17, 17, 1), ("development b", 24, 25, 0), ("unseen b", 12, 13, 2),
        ("unseen c", 13, 24, 3), ("unseen d", 14, 26, 5), ("unseen e", 14, 23, 3),
    ],
)  # fmt: skip
def test_dialogues(interpreter, encoder, name, least, answered, wrong):
    found = [outcome(interpreter, encoder, each) for each in DIALOGUES if each["set"] == name]
    assert sum(right and not answers for right, answers, _ in found) >= least, found
    assert sum(right for right, _, _ in found) >= answered, found
    assert sum(built and not answers for _, answers, built in found) <= wrong, found


SALAD = [
    "bigger flurb gronk", "make it gorp bigger", "a bit to the left of the moon", "on the left with feelings", "now a circle of doom",
    "left gronk", "gronk the left", "smaller purple", "bigger, and dance", "add the gronk", "wobble the gorp quickly",
]  # fmt: skip


@pytest.mark.parametrize("text", SALAD)
def test_words_that_mean_nothing_are_not_passed_over(interpreter, encoder, text):
    line = Goal((StructurePart("line", objects=(0, 1, 2)),))
    status, then = turn(interpreter, encoder, line, text, goal_scenes()["cans and cups"])
    assert status in ("refused", "ask") and then == line
