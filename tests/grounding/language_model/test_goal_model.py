"""A language model behind an address: what it is sent, and what becomes of its replies."""

import json
import re

import fastjsonschema
import pytest

from grounding.goals.goal import Goal
from grounding.goals.parts import RELATIONS
from grounding.language_model import goal_model
from grounding.language_model.goal_message import OpenQuestion, Turn
from grounding.language_model.goal_model import MAX_TEXT, PROMPT, GoalModel
from grounding.language_model.goal_reply import read_reply
from grounding.language_model.goal_schema import DECISIONS, reply_schema
from grounding.parsers import llm_endpoint
from grounding.parsers.llm_endpoint import EndpointLLM
from grounding.parsers.llm_reply import IllegalReplyError, LLMError
from grounding.spec import LEGAL_VALUES, SLOTS
from grounding.structure_words import KEYS
from prompts import load_prompt
from tests.grounding.language_model.oracle import MODEL, Oracle, OracleRow, serving_oracle
from tests.grounding.parsers.test_llm_endpoint import KEY, llama_url, says, serving  # noqa: F401

OBJECTS = ["can", "can 2", "mug", "bowl"]
TOWER = {"kind": "structure", "shape": "tower", "objects": [0, 1], "x_position": "left"}
GOAL = Goal.from_dict({"parts": [TOWER]})
REPLY = json.dumps({"decision": "build", "goal": {"parts": [TOWER]}})
_EXAMPLE = re.compile(
    r"^Objects: (?P<objects>.+)\n(?:Viewpoint: opposite\n)?(?:Goal: (?P<goal>.+)\n)?(?:Question: .+\n)?"
    r'Instruction: "(?P<text>.+)"\nOutput: (?P<reply>.+)$',
    re.MULTILINE,
)


def read(answer, text="stack the cans on the left", objects=OBJECTS, **more):
    """The reply that is read, and the bodies of the requests."""
    with serving(answer) as server:
        reply = GoalModel(EndpointLLM(server.url, "some-model")).read(text, objects, **more)
        return reply, [body for _, body in server.requests]


def test_the_examples_of_the_prompt_are_replies_that_are_accepted():
    prompt = load_prompt(PROMPT)
    examples = list(_EXAMPLE.finditer(prompt))
    assert len(examples) == prompt.count("Output:") == 11
    shown = set()
    for example in examples:
        names = None if example["objects"] == "null" else example["objects"].split(", ")
        if example["goal"]:
            assert Goal.from_dict(json.loads(example["goal"])).parts
        found = read_reply(example["reply"], names)
        shown.add(found.decision)
        assert len(found.options) == (2 if found.decision == "ask" else 0)
        if found.goal is not None:
            whole = {"question": None, "options": [], "reason": None} | json.loads(example["reply"])
            fastjsonschema.compile(reply_schema(len(names) if names else None))(whole | {"goal": found.goal.to_dict()})
    assert shown == set(DECISIONS)


def test_the_prompt_names_the_whole_vocabulary():
    prompt = load_prompt(PROMPT)
    words = [*RELATIONS, *KEYS, *SLOTS, *(value for slot in SLOTS for value in LEGAL_VALUES[slot])]
    assert [word for word in words if word not in prompt] == []


def test_the_request_holds_the_prompt_the_schema_and_the_message():
    question = OpenQuestion("which cans?")
    reply, (body,) = read(
        lambda *_: says(REPLY), goal=GOAL, question=question, turns=[Turn("stack them", "which cans?")],
        viewpoint="opposite",
    )  # fmt: skip
    assert reply.decision == "build" and reply.goal == GOAL
    system, user = body["messages"]
    assert system == {"role": "system", "content": load_prompt(PROMPT).strip()}
    message = json.loads(user["content"])
    assert user["role"] == "user" and list(message) == [
        "viewpoint", "table_cm", "objects", "goal", "question", "turns", "instruction"
    ]  # fmt: skip
    assert message["viewpoint"] == "opposite" and message["goal"] == GOAL.to_dict()
    assert message["question"] == {"text": "which cans?", "options": []}
    form = body["response_format"]
    assert form == {"type": "json_schema", "json_schema": {"name": "reply", "strict": True, "schema": reply_schema(4)}}


def test_a_failed_check_is_told_to_the_model_once():
    wrong = json.dumps({"decision": "build", "goal": {"parts": [TOWER | {"objects": [0, 9]}]}})
    reply, (first, second) = read(lambda number, _: says(wrong if number == 1 else REPLY))
    assert reply.goal == GOAL
    assert second["messages"][:2] == first["messages"]
    assert second["messages"][2] == {"role": "assistant", "content": wrong}
    message, again = (json.loads(body["messages"][-1]["content"]) for body in (first, second))
    assert again == message | {"problem": "objects are indices from 0 to 3, not 9"}
    with pytest.raises(IllegalReplyError, match="no legal answer in 2 tries: objects are indices from 0 to 3, not 9"):
        read(lambda *_: says(wrong))


def test_errors_hold_no_secrets(monkeypatch):
    monkeypatch.setenv("STRUCTAGENT_LLM_KEY", KEY)
    evil = json.dumps({"decision": "build", "goal": {"parts": [TOWER | {"shape": KEY}]}})
    with pytest.raises(IllegalReplyError, match="no legal answer in 2 tries") as caught:
        read(lambda *_: says(evil))
    assert "secret" not in str(caught.value) and KEY not in str(caught.value)


def test_a_server_that_refuses_the_schema_is_asked_without():
    row = OracleRow("stack the cans on the left", None, Goal(), "build", Goal.from_dict(
        {"parts": [TOWER | {"objects": ["the cans"]}]}
    ))  # fmt: skip
    with serving_oracle(Oracle([row], takes_schema=False)) as oracle:
        model = GoalModel(EndpointLLM(oracle.url, MODEL))
        assert model.takes_schema
        assert model.read(row.text, None).goal == row.goal
        assert not model.takes_schema
        assert model.read(row.text, None).goal == row.goal
    assert ["response_format" in body for body in oracle.requests] == [True, False, False]


def test_a_server_that_cannot_be_used_is_an_error():
    with pytest.raises(LLMError, match="could not be reached"):
        GoalModel(EndpointLLM("http://127.0.0.1:1/v1", "some-model")).read("stack the cans", OBJECTS)


def test_a_text_that_is_too_long_is_not_sent():
    with serving(lambda *_: says(REPLY)) as server, pytest.raises(IllegalReplyError, match="more than 4000 characters"):
        GoalModel(EndpointLLM(server.url, "some-model")).read("a" * (MAX_TEXT + 1), OBJECTS)
    assert server.requests == []


def test_a_real_server_takes_the_schema_and_keeps_to_it(llama_url, monkeypatch):  # noqa: F811
    """The small model fills the schema with nonsense, but it is JSON of the schema as far as it comes."""
    monkeypatch.setattr(goal_model, "MAX_ANSWER_TOKENS", 40)
    monkeypatch.setattr(llm_endpoint, "REASONING_TOKENS", 0)
    monkeypatch.setattr(goal_model, "load_prompt", lambda name: "Read.")
    said = []
    monkeypatch.setattr(goal_model, "read_reply", lambda content, *_: said.append(content))
    model = GoalModel(EndpointLLM(llama_url, "smollm2", answer_seconds=120))
    model.read("stack the cans on the left", OBJECTS)
    assert said[0].replace(" ", "").replace("\n", "").startswith('{"decision":"')
    assert model.takes_schema
