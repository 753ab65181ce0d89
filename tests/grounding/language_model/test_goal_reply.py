"""Replies of a language model: only goals that can be had are accepted, and the others are named in a sentence."""

import json

import pytest

from grounding.goals.goal import Goal
from grounding.language_model.goal_reply import MOST_OPTIONS, ModelReply, problem_of, read_reply

NAMES = ("red mug", "blue mug", "can", "can 2", "ball", "ball 2", "plate", "fork")
TOWER = {"kind": "structure", "shape": "tower", "objects": [2, 3], "x_position": "left"}
LEFT = {"kind": "relation", "relation": "left of", "objects": [0], "reference": [1]}
SECRET = "sk-very-secret-0123"


def build(*parts):
    return json.dumps({"decision": "build", "goal": {"parts": list(parts)}})


def test_a_goal_is_read_with_whatever_is_around_it():
    found = read_reply(f"Sure!\n```json\n{build(TOWER, LEFT)}\n```", NAMES)
    assert found == ModelReply("build", Goal.from_dict({"parts": [TOWER, LEFT]}))


def test_keys_that_are_null_are_not_there():
    part = LEFT | {"shape": None, "gap": None, "distance": None}
    assert read_reply(build(part), NAMES).goal == Goal.from_dict({"parts": [LEFT]})


def test_a_question_offers_what_can_be_had():
    options = [{"parts": [LEFT]}, {"parts": [TOWER | {"objects": [2]}]}, "the other one", {"parts": [LEFT]}, 7, ""]
    reply = {"decision": "ask", "goal": {"parts": [TOWER]}, "question": "Which\none?", "options": options}
    found = read_reply(json.dumps(reply), NAMES)
    assert found == ModelReply("ask", None, "Which one?", (Goal.from_dict({"parts": [LEFT]}), "the other one"))
    many = reply | {"options": [f"object {number}" for number in range(9)]}
    assert len(read_reply(json.dumps(many), NAMES).options) == MOST_OPTIONS


@pytest.mark.parametrize(
    ("decision", "reason"), [("refuse", "A bridge cannot be built."), ("none", "Two."), ("none", "")]
)
def test_a_refusal_and_a_remark_have_a_reason(decision, reason):
    said = {"decision": decision, "goal": None, "question": None, "options": [], "reason": reason or None}
    assert read_reply(json.dumps(said), NAMES) == ModelReply(decision, reason=reason)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("I would stack the cans.", "no JSON object"),
        (build(TOWER) * 2, "several"),
        (json.dumps({"goal": {"parts": [TOWER]}}), "decision is none of build, ask, refuse, none"),
        (json.dumps({"decision": "build", "goal": None}), "has no goal"),
        (json.dumps({"decision": "build", "goal": []}), "has no goal"),
        (build(), "has no parts"),
        (json.dumps({"decision": "ask", "question": " "}), "no question"),
        (json.dumps({"decision": "refuse"}), "no reason"),
        (build("tower"), "part 0 is a JSON object"),
        (build({"kind": "tower"}), "kind cannot be 'tower'"),
        (build({"kind": "relation"}), "relation cannot be None"),
        (build({"kind": "relation", "relation": "on", "reference": [1]}), "needs objects"),
        (build(TOWER | {"shape": "giraffe"}), "giraffe"),
        (build(TOWER | {"radius": 0.1}), "cannot have the key radius"),
        (build(TOWER | {"colour": "red"}), "unknown key 'colour'"),
        (build({"kind": "structure", "shape": "line", "gap": 5}), "gap cannot be 5 m"),
        (build(LEFT | {"objects": {"part": 1}}), "refers to part 1"),
        (build(LEFT | {"objects": [8]}), "objects are indices from 0 to 7, not 8"),
        (build(LEFT | {"objects": ["red mug"]}), "objects are indices from 0 to 7, not 'red mug'"),
        (build(TOWER | {"objects": [2]}), "a tower needs 2 objects, but .* is only 1"),
        (
            build({"kind": "structure", "shape": "grid", "objects": [0, 1], "rows": 1, "columns": 2}),
            "a grid needs 4 objects",
        ),
        (build(TOWER | {"objects": [4, 5]}), "nothing can stand on a ball"),
        (build({"kind": "structure", "shape": "line"}, TOWER | {"objects": list(range(8))}), "there are none"),
        (build(LEFT, LEFT | {"objects": [1], "reference": [0]}), "cannot hold together"),
        ("[" * 5000, "no JSON object"),
    ],
)
def test_what_cannot_be_had_is_named(content, why):
    with pytest.raises(ValueError, match=why):
        read_reply(content, NAMES)


def test_words_stand_for_objects_where_no_scene_is_known():
    said = LEFT | {"objects": ["the mug"], "reference": ["the bowl"]}
    assert read_reply(build(said), None).goal == Goal.from_dict({"parts": [said]})
    with pytest.raises(ValueError, match="words of the instruction, because no objects are known, not 0"):
        read_reply(build(LEFT), None)
    again = said | {"objects": ["the bowl"], "reference": ["the mug"]}
    assert "cannot hold together" in problem_of(Goal.from_dict({"parts": [said, again]}), None)


def test_nothing_repeats_a_secret():
    with pytest.raises(ValueError, match="this goal cannot be built"):
        read_reply(build(TOWER | {"shape": SECRET}), NAMES, [SECRET])
    refused = {"decision": "none", "reason": f"the key is {SECRET.upper()}"}
    assert read_reply(json.dumps(refused), NAMES, [SECRET]) == ModelReply("none")
