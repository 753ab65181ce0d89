"""Ask a language model behind an OpenAI-compatible address for a goal as JSON, under a schema of all legal goals."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.written_references import UnusableGoalError
from grounding.goals.goal import MAX_PARTS, Goal
from grounding.goals.parts import (
    EDGES,
    GROUPINGS,
    MAX_LENGTH,
    MAX_ROWS,
    MOVE_DIRECTIONS,
    ORDER_DIRECTIONS,
    ORDER_KEYS,
    ORDER_STARTS,
    RELATIONS,
    GoalError,
)
from grounding.llm_goals.checks import phrases_of
from grounding.llm_goals.lines import NO_GOAL, Said
from grounding.parsers.llm import MAX_BYTES
from grounding.parsers.llm_endpoint import EndpointLLM
from grounding.parsers.llm_json import json_object, shares_secret
from grounding.parsers.llm_reply import quotable
from grounding.spec import LEGAL_VALUES, X_POSITIONS, Y_POSITIONS
from prompts import load_prompt

PROMPT = "parse_goal"
BUILD = "build"
MAX_ANSWER_TOKENS = 3000  # twelve parts with every key
_AS_JSON = "Answer with one JSON object of this form and nothing else."


def _one_of(values: Collection[str]) -> dict[str, Any]:
    return {"enum": [*values, None]}


_NAMES = {"type": "array", "items": {"type": "string"}}
_LENGTH = {"type": ["number", "null"], "minimum": 0, "maximum": MAX_LENGTH}
_COUNT = {"type": ["integer", "null"], "minimum": 1, "maximum": MAX_ROWS}


def _object(properties: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "type": "object", "properties": dict(properties), "required": list(properties), "additionalProperties": False,
    }  # fmt: skip


_PART = _object({"part": {"type": "integer", "minimum": 0, "maximum": MAX_PARTS - 1}})
_ORDER = _object(
    {"by": {"enum": list(ORDER_KEYS)}, "direction": _one_of(ORDER_DIRECTIONS), "from": _one_of(ORDER_STARTS)}
)
_STRUCTURE = _object(
    {
        "kind": {"const": "structure"},
        "shape": _one_of(LEGAL_VALUES["shape"]),
        "objects": {"anyOf": [_NAMES, {"type": "null"}]},
    }
    | {slot: _one_of(values) for slot, values in LEGAL_VALUES.items() if slot != "shape"}
    | {"order": {"anyOf": [_ORDER, {"type": "null"}]}, "gap": _LENGTH, "radius": _LENGTH, "length": _LENGTH}
    | {"rows": _COUNT, "columns": _COUNT, "around": {"anyOf": [_NAMES, {"type": "null"}]}}
    | {"along": _one_of(EDGES), "group_by": _one_of(GROUPINGS)}
)
_RELATION = _object(
    {"kind": {"const": "relation"}, "relation": {"enum": list(RELATIONS)}, "objects": {"anyOf": [_NAMES, _PART]}}
    | {"reference": {"anyOf": [_NAMES, _PART, {"type": "null"}]}, "distance": _LENGTH}
    | {"x_position": _one_of(X_POSITIONS), "y_position": _one_of(Y_POSITIONS), "direction": _one_of(MOVE_DIRECTIONS)}
)
SCHEMA = _object(
    {
        "request": {"enum": [BUILD, *NO_GOAL]},
        "parts": {"type": "array", "items": {"anyOf": [_STRUCTURE, _RELATION]}, "maxItems": MAX_PARTS},
    }
)


class EndpointGoals:
    """A chat model at an OpenAI-compatible address as a writer of goals.

    Args:
        endpoint: the model.
    """

    knows_words = True

    def __init__(self, endpoint: EndpointLLM) -> None:
        self.endpoint = endpoint
        self.identity = endpoint.identity
        self.prompt = load_prompt(PROMPT)

    def parts(self, text: str, chunks: Sequence[Chunk]) -> list[dict[str, Any]] | str:
        """Return the parts as JSON values, with words of the instruction for objects, or a word of `NO_GOAL`.

        Raises:
            LLMError: for a server that cannot be used; an `IllegalReplyError` after two replies that are no goal.
            UnusableGoalError: for objects in other words than the instruction's.
        """
        said = quotable(text)
        if len(said.encode()) > MAX_BYTES:
            raise UnusableGoalError("was not asked for, because the instruction is too long for it")
        parts = self.endpoint.ask_json(
            f"{self.prompt.strip()}\n\n{_AS_JSON}", said, ("goal", SCHEMA), MAX_ANSWER_TOKENS,
            lambda content: read_goal(content, self.endpoint.secrets),
        )  # fmt: skip
        words = f" {Said.of(said).text.replace(',', '')} "
        for phrase in phrases_of(parts if isinstance(parts, list) else ()):
            if f" {Said.of(phrase).text.replace(',', '')} " not in words:
                raise UnusableGoalError("names objects in words that are not in the instruction")
        return parts


def read_goal(content: str, secrets: Collection[str] = ()) -> list[dict[str, Any]] | str:
    """Parse a model's reply: one JSON object with a request and parts, with any text around it.

    Args:
        content: the reply.
        secrets: what no message may hold, in any spelling.

    Raises:
        ValueError: for a reply that is no legal goal; the message holds none of the secrets.
    """
    said = json_object(content)
    if set(said) - {"request", "parts"} or "request" not in said:
        raise ValueError("it has other keys than request and parts")
    request = said["request"]
    if request not in (BUILD, *NO_GOAL):
        raise ValueError(f"its request is none of {', '.join((BUILD, *NO_GOAL))}")
    parts = said.get("parts", [])
    if request != BUILD:
        if parts:
            raise ValueError(f"its request is {request!r}, and it has parts")
        return str(request)
    try:
        if not Goal.from_dict({"parts": parts}).parts:
            raise ValueError("it has no parts")
    except GoalError as error:
        message = " ".join(str(error).split())[:200]
        raise ValueError(
            "it is not a legal goal" if any(shares_secret(message, each) for each in secrets) else message
        ) from None
    return json.loads(json.dumps(parts))
