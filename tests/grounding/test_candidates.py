"""Proposals of one goal are one; those that can be built are judged,
with the slots that the parser reads as another candidate.
"""

import numpy as np
import pytest

from grounding.candidates import added_up, judged
from grounding.parse_result import Parse
from grounding.propose.proposal import Proposal, WordedGoal
from grounding.resolve.attributes import SceneObject
from grounding.spec import StructureSpec
from grounding.verify.verifier import Judgement
from tests.grounding.goal_in_words import goal_of_words

THERE = [SceneObject("cup"), SceneObject("cup 2"), SceneObject("can")]
LINE = goal_of_words("line of 0, 1")
WORDED = WordedGoal(0.5, ({"kind": "structure", "shape": "line", "objects": ["the cups"]},))


class Verifier:
    """Takes every word for lost that begins with x."""

    def judge(self, pairs):
        return [
            Judgement(
                float(number), np.array([0.9 * word.startswith("x") for word in pair.words[pair.first : pair.end]])
            )
            for number, pair in enumerate(pairs)
        ]


def parse(**slots):
    return Parse("t", StructureSpec(**slots), "p", confidence={"shape": 0.9, "size": 0.8})


def test_proposals_of_the_same_goal_are_added_up():
    ones = [
        Proposal(goal_of_words(words), share)
        for words, share in (("0 left of 1", 0.2), ("line of 0, 1", 0.5), ("0 left of 1", 0.4))
    ]
    answers = [Proposal(None, 0.1, "nothing"), Proposal(None, 0.2, "nothing"), Proposal(None, 0.05, problem="no")]
    found = added_up([*ones, *answers], 3)
    assert [(str(one.goal or one.answer or one.problem), round(one.certainty, 2)) for one in found] == [
        ("0 left of 1", 0.6), ("line of 0, 1", 0.5), ("nothing", 0.3), ("no", 0.05),
    ]  # fmt: skip


def test_what_cannot_be_built_and_the_goal_so_far_are_no_candidates():
    ones = [Proposal(LINE, 0.5), Proposal(LINE, 0.3, problem="no"), Proposal(None, 0.2, "nothing")]
    assert [one.proposal for one in judged("t", ones, Verifier(), THERE)] == ones[:1]
    assert judged("t", ones, Verifier(), THERE, LINE) == []


@pytest.mark.parametrize(
    ("slots", "goals", "agreement"),
    [
        ({"shape": "line"}, ["line of 0, 1"], [0.8]),
        ({"shape": "line", "size": "small"}, ["line of 0, 1", "line of 0, 1, small"], [-0.8, 0.8]),
    ],
)
def test_the_parsers_slots_are_a_candidate_of_their_own(slots, goals, agreement):
    found = judged("line up", [Proposal(LINE, 0.5, worded=WORDED)], Verifier(), THERE, parse=parse(**slots))
    assert [str(one.proposal.goal) for one in found] == goals and [one.agreement for one in found] == agreement
    assert found[-1].proposal.worded.parts[0]["objects"] == ["the cups"]


def test_no_candidate_stands_twice():
    ones = [Proposal(LINE, 0.5, worded=WORDED), Proposal(goal_of_words("line of 0, 1, small"), 0.2, worded=WORDED)]
    found = judged("line up", ones, Verifier(), THERE, parse=parse(shape="line", size="small"))
    assert [str(one.proposal.goal) for one in found] == ["line of 0, 1", "line of 0, 1, small"]


def test_words_that_are_lost_are_quoted_as_they_follow_one_another():
    (found,) = judged("xa xb line xc", [Proposal(LINE, 0.5)], Verifier(), THERE)
    assert found.lost == ("xa xb", "xc") and found.doubt == pytest.approx(0.9)
