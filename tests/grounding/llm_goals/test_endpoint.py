"""Goals from a model behind an address: the schema holds all legal goals, and only legal goals are accepted."""

import json

import fastjsonschema
import pytest

from grounding.goal_reading.written_references import UnusableGoalError
from grounding.goals.goal import Goal
from grounding.llm_goals import endpoint
from grounding.llm_goals.endpoint import SCHEMA, EndpointGoals, read_goal
from grounding.parsers import llm_endpoint
from grounding.parsers.llm_endpoint import EndpointLLM
from grounding.parsers.llm_reply import IllegalReplyError
from prompts import load_prompt, prompt_lines
from tests.grounding.parsers.test_llm_endpoint import KEY, llama_url, says, serving  # noqa: F401

SPOKEN = "stack the cans on the left and put the mug behind it"
PARTS = [
    {"kind": "structure", "shape": "tower", "objects": ["the cans"], "x_position": "left"},
    {"kind": "relation", "relation": "behind", "objects": ["the mug"], "reference": {"part": 0}},
]
REPLY = json.dumps({"request": "build", "parts": PARTS})


def whole(parts):
    """The parts with every key, as the schema wants them."""
    return Goal.from_dict({"parts": parts}).to_dict()["parts"]


def ask(answer, text=SPOKEN):
    with serving(answer) as server:
        return EndpointGoals(EndpointLLM(server.url, "some-model")).parts(text, []), server.requests


def test_the_examples_of_the_prompt_are_legal_replies_and_goals_of_the_schema():
    examples = prompt_lines(load_prompt("parse_goal"))
    legal = fastjsonschema.compile(SCHEMA)
    assert len(examples) >= 8
    for text, output in examples:
        parts = read_goal(output)
        if isinstance(parts, str):
            assert json.loads(output)["parts"] == []
            continue
        legal({"request": "build", "parts": whole(parts)})
        for part in parts:
            for phrases in (part.get("objects"), part.get("reference"), part.get("around")):
                assert all(phrase in text for phrase in phrases if isinstance(phrases, list)) if phrases else True


@pytest.mark.parametrize(
    "part",
    [
        {"kind": "structure", "shape": "grid", "objects": None, "rows": 3, "columns": 2, "gap": 0.05},
        {
            "kind": "structure",
            "shape": "line",
            "objects": ["a", "b"],
            "order": {"by": "listed", "direction": None, "from": "near"},
        },
        {"kind": "structure", "shape": "circle", "objects": ["a"], "radius": 0.15, "around": ["b"]},
        {"kind": "structure", "shape": "cluster", "objects": None, "group_by": "colour"},
        {"kind": "relation", "relation": "moved", "objects": ["a"], "direction": "closer", "distance": 0.1},
        {"kind": "relation", "relation": "at", "objects": ["a"], "x_position": "left", "y_position": "top"},
        {"kind": "relation", "relation": "between", "objects": ["a"], "reference": ["b", "c"]},
    ],
)
def test_every_goal_fits_the_schema(part):
    fastjsonschema.compile(SCHEMA)({"request": "build", "parts": whole([part])})


def test_the_schema_is_strict():
    """Endpoints take strict schemas only if every object lists all its keys as required and allows no others."""

    def objects(schema):
        if isinstance(schema, dict):
            if schema.get("type") == "object":
                yield schema
            for value in schema.values():
                yield from objects(value)
        elif isinstance(schema, list):
            for value in schema:
                yield from objects(value)

    found = list(objects(SCHEMA))
    assert len(found) >= 5
    for schema in found:
        assert schema["required"] == list(schema["properties"]) and schema["additionalProperties"] is False


def test_the_request_holds_the_schema_and_the_instruction():
    parts, ((_, body),) = ask(lambda *_: says(REPLY))
    assert parts == PARTS
    assert body["response_format"]["json_schema"] == {"name": "goal", "strict": True, "schema": SCHEMA}
    assert body["messages"][0]["content"].startswith(load_prompt("parse_goal").strip()[:60])
    assert body["messages"][1]["content"] == f'Instruction: "{SPOKEN}"'


@pytest.mark.parametrize("word", ["nothing", "impossible", "unclear"])
def test_a_model_can_say_that_there_is_no_goal(word):
    assert read_goal(json.dumps({"request": word, "parts": []})) == word


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("I would stack the cans.", "no JSON object"),
        (REPLY * 2, "several"),
        (json.dumps({"parts": PARTS}), "other keys"),
        (json.dumps({"request": "perhaps", "parts": []}), "its request is none of"),
        (json.dumps({"request": "build", "parts": []}), "no parts"),
        (json.dumps({"request": "nothing", "parts": PARTS}), "has parts"),
        (json.dumps({"request": "build", "parts": [PARTS[1]]}), "refers to part 0"),
        (json.dumps({"request": "build", "parts": [PARTS[0] | {"shape": "heart"}]}), "heart"),
        (json.dumps({"request": "build", "parts": [PARTS[0] | {"radius": 0.1}]}), "takes no radius"),
        (json.dumps({"request": "build", "parts": [PARTS[0] | {"colour": "red"}]}), "unknown key"),
        (json.dumps({"request": "build", "parts": [{"kind": "structure", "shape": "line", "gap": -1}]}), "gap"),
        (json.dumps({"request": "build", "parts": [PARTS[0]] * 13}), "more than a goal can have"),
        (json.dumps({"request": "build", "parts": "all"}), "list"),
        ("[" * 5000, "no JSON object"),
    ],
)
def test_what_is_no_legal_goal_is_no_answer(content, why):
    with pytest.raises(ValueError, match=why):
        read_goal(content)


def test_an_illegal_goal_is_asked_for_once_more_and_then_an_error_without_secrets(monkeypatch):
    monkeypatch.setenv("STRUCTAGENT_LLM_KEY", KEY)
    parts, requests = ask(lambda n, _: says("no" if n == 1 else REPLY))
    assert parts == PARTS and len(requests) == 2
    evil = json.dumps({"request": "build", "parts": [PARTS[0] | {"shape": KEY}]})
    with pytest.raises(IllegalReplyError, match="no legal answer in 2 tries") as caught:
        ask(lambda *_: says(evil))
    assert "secret" not in str(caught.value) and KEY not in str(caught.value)


def test_objects_in_other_words_than_the_instructions_are_not_used():
    invented = [PARTS[0] | {"objects": ["the tins"]}]
    with pytest.raises(UnusableGoalError, match="words that are not in the instruction"):
        ask(lambda *_: says(json.dumps({"request": "build", "parts": invented})))


def test_a_server_without_schemas_is_asked_in_plain_words():
    def answer(_, body):
        return (400, {}, b"unknown field") if "response_format" in body else says(f"Here: {REPLY}")

    parts, requests = ask(answer)
    assert parts == PARTS and ["response_format" in body for _, body in requests] == [True, False]


def test_a_text_that_is_too_long_is_not_sent():
    with serving(lambda *_: says(REPLY)) as server:
        with pytest.raises(UnusableGoalError, match="too long"):
            EndpointGoals(EndpointLLM(server.url, "some-model")).parts("put the mug on the plate " * 100, [])
    assert server.requests == []


def test_a_real_server_takes_the_schema_and_keeps_to_it(llama_url, monkeypatch):  # noqa: F811
    """The small model fills the schema with nonsense, but it is JSON of the schema as far as it comes."""
    monkeypatch.setattr(endpoint, "MAX_ANSWER_TOKENS", 40)
    monkeypatch.setattr(llm_endpoint, "REASONING_TOKENS", 0)
    goals = EndpointGoals(EndpointLLM(llama_url, "smollm2", answer_seconds=120))
    goals.prompt = "Read."
    said = []
    monkeypatch.setattr(endpoint, "read_goal", lambda content, secrets: said.append(content) or "unclear")
    assert goals.parts(SPOKEN, []) == "unclear"
    assert said[0].replace(" ", "").replace("\n", "").startswith('{"request":"')
    assert "response_format" in goals.endpoint.dialect.keys  # it was not asked without
