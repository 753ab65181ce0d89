"""What becomes of a text: build, ask or refuse."""

import pytest

from grounding.decide import Candidate, decide
from grounding.parse_result import Question
from grounding.propose.proposal import Proposal
from tests.grounding.goal_in_words import goal_of_words

LINE, CIRCLE = Proposal(goal_of_words("line of 0, 1, 2"), 0.6), Proposal(goal_of_words("circle of 0, 1, 2"), 0.3)
DOUBT = Proposal(None, 0.1, question=Question("object", "which cup?", ("cup", "cup 2")))
BY_VERIFIER = (0, 1, *(0,) * 12)  # the probability is that of the verifier's logit


def decided(*logits, proposals=(LINE, CIRCLE)):
    return decide([Candidate(one, logit) for one, logit in zip(proposals, logits)], proposals, BY_VERIFIER)


@pytest.mark.parametrize(
    ("logits", "status", "offered"),
    [((3, -3), "ok", 0), ((-3, 3), "ok", 0), ((0, -3), "ask", 1), ((0, -1), "ask", 2), ((-3, -3), "refused", 0)],
)
def test_two_thresholds(logits, status, offered):
    found = decided(*logits)
    assert (found.status, len(found.offered)) == (status, offered)
    assert found.chosen.proposal is (LINE if logits[0] >= logits[1] else CIRCLE)


@pytest.mark.parametrize(
    ("others", "status"),
    [
        ((), "ask"),
        ((Proposal(None, 0.8, "unclear"),), "ask"),  # the question says what is unclear
        ((Proposal(None, 0.8, "impossible"),), "refused"),
        ((Proposal(None, 0.8, "nothing"),), "refused"),
        ((Proposal(LINE.goal, 0.5),), "refused"),
        ((Proposal(LINE.goal, 0.05),), "ask"),
        ((Proposal(None, 0.5, problem="there is no plate"),), "refused"),  # what is likelier meant cannot be had
    ],
)
def test_objects_in_doubt_are_asked_about_where_no_other_reading_is_likelier(others, status):
    found = decide([], (*others, DOUBT), BY_VERIFIER)
    assert found.status == status and (found.chosen is None) == (status == "refused")


@pytest.mark.parametrize(("certainty", "status"), [(0.7, "refused"), (0.5, "ok")])
def test_what_can_be_had_does_not_take_the_place_of_what_was_likelier_meant(certainty, status):
    cannot = Proposal(CIRCLE.goal, certainty, problem="a circle needs 3 objects")
    assert decide([Candidate(LINE, 3)], (LINE, cannot), BY_VERIFIER).status == status


@pytest.mark.parametrize(("follows", "status"), [(True, "ask"), (False, "ok")])
def test_words_that_nobody_knows_are_asked_about_or_told(follows, status):
    found = decide([Candidate(LINE, 9, unknown=("gronk",))], (LINE,), BY_VERIFIER, follows)
    assert found.status == status and (found.chosen.unknown, found.offered) == (
        ("gronk",),
        (LINE.goal,) if follows else (),
    )
    assert found.chosen.lost == ("gronk",)


@pytest.mark.parametrize(("scene", "status"), [(True, "ask"), (False, "ok")])
def test_a_word_that_is_likely_lost_is_asked_about_in_a_scene(scene, status):
    found = decide([Candidate(LINE, 9, lost=("upside down",), doubt=0.97)], (LINE,), BY_VERIFIER, False, scene)
    assert (found.status, found.chosen.lost) == (status, ("upside down",))


def test_a_wish_without_a_shape_asks_for_one():
    objects = Proposal(goal_of_words("structure of 0, 1, 2"), 0.3)
    unclear = Proposal(None, 0.5, "unclear")
    found = decide([Candidate(objects, -3.0)], (unclear, objects), BY_VERIFIER)
    # A goal without a shape leads to the question of its shape
    assert found.status == "ok" and found.chosen.proposal is objects


@pytest.mark.parametrize(
    ("certainty", "lost", "follows", "status"),
    [
        (0.02, (), False, "ask"),
        (0.02, ("two",), False, "refused"),
        (0.001, (), False, "refused"),
        (0.02, (), True, "refused"),
    ],
)
def test_what_holds_every_word_is_asked_about_though_it_seems_impossible(certainty, lost, follows, status):
    one = Proposal(LINE.goal, certainty)
    proposals = (Proposal(None, 0.9, "impossible"), one)
    found = decide([Candidate(one, -4.0, lost)], proposals, BY_VERIFIER, follows)
    assert found.status == status
