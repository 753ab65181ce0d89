"""Conversations of two to six turns about goals: what stands after each turn, or that a question or a refusal comes.

`goal_dialogues.jsonl.xz` (`xzcat` prints it) has two pairs of sets. The first: 40 dialogues with which corrections were
developed, and 20 that were read for the first time when that was done (then 10 of the 20 came out right in every turn).
The second, of another day: 25 that were mended (12 right at first), and 16 that were read for the first time after that
(then 7 right). "unseen c" and "unseen d" are 40 dialogues each of two writers who knew nothing of the rules, "unseen e"
are 30 of a third, "unseen g" are 40 longer ones of a fourth, "unseen h" are 60 of a fifth, of three to six turns, and
"unseen i" are 40 of a seventh, of four and five; nobody opens them, rates only. "development c" are 60 of another
writer as twenty people: 21 came out right when they were read for the first time, 22 after an answer, 7 otherwise;
"development d" are 60 of one more, who wrote harder ones: 10, 17 and 8. "unseen m", "unseen n", "unseen o" and "unseen
p" are 60 each of four more, which nobody opens. A dialogue ends at its first turn that goes wrong.
"""

from __future__ import annotations

import json
import lzma
from pathlib import Path

import pytest

from grounding.dialogue.state import Dialogue
from grounding.dialogue.turns import answer, say
from grounding.goal_benchmark.rows import goal_scenes
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from tests.grounding.goal_in_words import goal_of_words
from tests.grounding.side_by_side import side_by_side

_PACKED = Path(__file__).with_name("goal_dialogues.jsonl.xz")
DIALOGUES = [json.loads(line) for line in lzma.decompress(_PACKED.read_bytes()).decode().splitlines()]


def outcome(reader, dialogue):
    """Hold a dialogue; return whether all turns came out right, how many questions were answered before it ended, and
    whether it ended with something else built. A question is answered with the right goal where that is one of its
    answers.
    """
    objects, answered = goal_scenes()[dialogue["scene"]], 0
    names = [one.name for one in objects]
    state = Dialogue()
    for each in dialogue["turns"]:
        yield state, each["say"], objects, ()
        state, found = say(state, each["say"], reader, objects)
        refused = found.status in ("refused", "nothing", "unchanged", "ask") and "refused" in each["then"]
        asked = found.status == "ask" and "ask" in each["then"]
        if found.status == "ask" and not (refused or asked):
            right = [number for number, one in enumerate(state.choices) if _is(one, each["then"], len(objects))]
            if right:
                state, found = answer(state, right[0], names)
                answered += 1
        same = found.status == "unchanged" and _is(state.goal, each["then"], len(objects))
        if not (refused or asked or same or (found.status == "ok" and _is(found.goal, each["then"], len(objects)))):
            return False, answered, found.status == "ok"
    return True, answered, False


_ANSWERS = ("ask", "refused", "unchanged")


def _is(goal, expected, count):
    """Return whether a goal is one of those expected."""
    return any(compare_goals(goal, goal_of_words(each), count).exact for each in expected if each not in _ANSWERS)


# Of each set the least that come out right in every turn, right after questions that were answered, and the most that
# are built otherwise: one off what was measured.
RATES = [
    ("development", 29, 35, 3), ("unseen", 13, 17, 1), ("development b", 14, 21, 3), ("unseen b", 11, 11, 4),
    ("unseen c", 23, 27, 2), ("unseen d", 27, 35, 2), ("unseen e", 23, 25, 4), ("unseen g", 28, 32, 5),
    ("unseen h", 44, 49, 4), ("unseen i", 26, 32, 4), ("unseen j", 72, 97, 4), ("development c", 37, 45, 6),
    ("development d", 12, 28, 9), ("unseen m", 30, 43, 2), ("unseen n", 26, 36, 9), ("unseen o", 13, 25, 11),
    ("unseen p", 19, 33, 6),
]  # fmt: skip


@pytest.mark.parametrize(("name", "least", "answered", "wrong"), RATES)
def test_dialogues(interpreter, name, least, answered, wrong):
    own = [each for each in DIALOGUES if each["set"] == name]
    found = side_by_side(interpreter, lambda reader: [outcome(reader, each) for each in own])
    counts = {
        "of": len(found), "right": sum(right and not answers for right, answers, _ in found),
        "with answers": sum(right for right, _, _ in found),
        "built otherwise": sum(built and not answers for _, answers, built in found),
    }  # fmt: skip
    print(name, counts)
    assert counts["right"] >= least and counts["with answers"] >= answered and counts["built otherwise"] <= wrong, (
        counts
    )


SALAD = [
    ("bigger flurb gronk", "gronk"), ("make it gorp bigger", "gorp"), ("a bit to the left of the moon", "moon"),
    ("on the left with feelings", "feelings"), ("now a circle of doom", "doom"), ("left gronk", "gronk"),
    ("gronk the left", "gronk"),
    ("smaller purple", "purple"), ("bigger, and dance", "dance"), ("add the gronk", "gronk"),
    ("wobble the gorp quickly", "gorp"),
]  # fmt: skip
PASSED_OVER = {"on the left with feelings", "now a circle of doom"}
UNSEEN = pytest.mark.xfail(reason="the verifier does not see it yet", strict=False)


@pytest.mark.parametrize(
    ("text", "word"), [pytest.param(*row, marks=[UNSEEN] if row[0] in PASSED_OVER else [], id=row[0]) for row in SALAD]
)
def test_words_that_mean_nothing_are_not_passed_over(interpreter, text, word):
    line = Dialogue(Goal((StructurePart("line", objects=(0, 1, 2)),)))
    state, found = say(line, text, interpreter, goal_scenes()["cans and cups"])
    if found.status == "ok":  # built with a remark on the word
        assert word in found.message, str(found.goal)
    else:
        assert state.goal == line.goal
