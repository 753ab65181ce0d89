"""From probabilities to a decision: what goes together, when to ask, when to refuse."""

import pytest

from grounding.parse_result import REFUSALS, decide, make_legal, refusal
from grounding.spec import LEGAL_VALUES, SLOTS, StructureSpec


def said(**values):
    """Probabilities of 0.9 for the given values and for leaving the other slots open."""
    shares = {}
    for slot in SLOTS:
        answers = (*LEGAL_VALUES[slot], None)
        shares[slot] = dict.fromkeys(answers, 0.1 / (len(answers) - 1)) | {values.get(slot): 0.9}
    return shares


BUILD = dict.fromkeys(REFUSALS, 0.01)


def test_the_likeliest_values_are_taken():
    parse = decide(
        "a small ring",
        said(shape="circle", size="small"),
        {"shape": ("ring",), "x_position": ("a",)},
        BUILD,
        "p",
    )
    assert parse.spec == StructureSpec("circle", "small") and parse.status == "ok" and parse.message == ""
    assert parse.confidence == dict.fromkeys(SLOTS, 0.9)
    assert parse.evidence == {"shape": ("ring",)}, "an open slot has no evidence"


def test_the_less_certain_of_two_gives_way():
    heard = {"shape": "tower", "size": "small", "x_position": "left", "y_position": None, "rotation": None}
    sure = dict.fromkeys(SLOTS, 0.9)
    assert StructureSpec(**make_legal(heard, sure)) == StructureSpec("tower", x_position="left")
    assert StructureSpec(**make_legal(heard, sure | {"shape": 0.4})) == StructureSpec(None, "small", "left")


def test_what_cannot_go_together_is_told():
    parse = decide("t", said(shape="tower", size="large", rotation="east"), {}, BUILD, "p")
    assert parse.spec == StructureSpec("tower") and parse.dropped == {"size": "large", "rotation": "east"}


def test_a_doubtful_slot_is_asked_for():
    shares = said(shape="circle")
    shares["x_position"] = {"left": 0.44, "right": 0.41, "center": 0.05, None: 0.1}
    parse = decide("ring lft or rgt", shares, {}, BUILD, "p")
    assert parse.status == "ask" and parse.question.slot == "x_position"
    assert parse.question.options == ("left", "right", "open")
    assert "left, right or open" in parse.message
    assert parse.spec.x_position == "left", "the best reading is given along"


def test_a_missing_shape_is_asked_for_only_if_nothing_else_is_said():
    assert decide("t", said(), {}, BUILD, "p").question.slot == "shape"
    assert decide("t", said(x_position="left"), {}, BUILD, "p").status == "ok"


@pytest.mark.parametrize("reason", REFUSALS)
def test_refusals(reason):
    parse = decide("do it", said(shape="line"), {}, BUILD | {reason: 0.6}, "p", "abc")
    assert parse == refusal("do it", reason, "p", prompt_sha256="abc")
    assert parse.status == "refused" and REFUSALS[reason] in parse.message and "'do it'" in parse.message
    assert not parse.spec.tokens() and not parse.confidence


def test_reasons_add_up():
    assert decide("t", said(shape="line"), {}, {"idle": 0.3, "several": 0.3}, "p").status == "refused"
    assert decide("t", said(shape="line"), {}, {"idle": 0.2, "several": 0.2}, "p").status == "ok"
