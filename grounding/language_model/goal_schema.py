"""Write the JSON schema of a language model's reply, in the subset that strict servers take.

Every key is required, nothing else is allowed, and there are no bounds of numbers or lists: what a schema cannot say is
checked when the reply is read.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from grounding.goals.parts import (
    EDGES,
    GROUPINGS,
    MOVE_DIRECTIONS,
    ORDER_DIRECTIONS,
    ORDER_KEYS,
    ORDER_STARTS,
    RELATIONS,
)
from grounding.spec import LEGAL_VALUES, X_POSITIONS, Y_POSITIONS

BUILD, ASK, REFUSE, NONE = "build", "ask", "refuse", "none"
DECISIONS = (BUILD, ASK, REFUSE, NONE)
_NUMBER: Mapping[str, Any] = {"type": ["number", "null"]}
_TEXT: Mapping[str, Any] = {"type": ["string", "null"]}


def reply_schema(count: int | None) -> dict[str, Any]:
    """Return the schema of a reply.

    Args:
        count: of objects in the scene, which are named by their indices; `None` where they are named in words.
    """
    goal = _goal(count)
    option = {"anyOf": [goal, {"type": "string"}]}
    return _object(
        {
            "decision": {"type": "string", "enum": list(DECISIONS)},
            "goal": _or_null(goal),
            "question": _TEXT,
            "options": {"type": "array", "items": option},
            "reason": _TEXT,
        }
    )


def _goal(count: int | None) -> dict[str, Any]:
    one = {"type": "string"} if count is None else {"type": "integer", "enum": list(range(count))}
    objects = {"type": "array", "items": one}
    part = _object({"part": {"type": "integer"}})
    order = _object(
        {
            "by": {"type": "string", "enum": list(ORDER_KEYS)},
            "direction": _one_of(ORDER_DIRECTIONS),
            "from": _one_of(ORDER_STARTS),
        }
    )
    structure = _object(
        {"kind": {"type": "string", "enum": ["structure"]}, "objects": _or_null(objects)}
        | {"shape": _TEXT}  # a shape, or a figure: any word can be written
        | {slot: _one_of(values) for slot, values in LEGAL_VALUES.items() if slot != "shape"}
        | {"order": _or_null(order), "gap": _NUMBER, "radius": _NUMBER, "length": _NUMBER}
        | {"rows": {"type": ["integer", "null"]}, "columns": {"type": ["integer", "null"]}}
        | {"around": _or_null(objects), "along": _one_of(EDGES), "group_by": _one_of(GROUPINGS)}
    )
    pair = {"type": "array", "items": {"type": "number"}}
    block = {"x": {"type": "number"}, "level": {"type": "integer"}, "width": {"type": "number"}}
    drawing = {
        "strokes": _or_null({"type": "array", "items": {"type": "array", "items": pair}}),
        "blocks": _or_null({"type": "array", "items": _object(block)}),
        "least": {"type": ["integer", "null"]},
    }
    drawn = _object(
        {"kind": {"type": "string", "enum": ["structure"]}, "objects": _or_null(objects)}
        | {"shape": {"type": "string"}, "drawing": _object(drawing)}  # its name, which no figure has
        | {slot: _one_of(values) for slot, values in LEGAL_VALUES.items() if slot != "shape"}
    )
    relation = _object(
        {
            "kind": {"type": "string", "enum": ["relation"]},
            "relation": {"type": "string", "enum": list(RELATIONS)},
            "objects": {"anyOf": [objects, part]},
            "reference": {"anyOf": [objects, part, {"type": "null"}]},
            "distance": _NUMBER,
            "x_position": _one_of(X_POSITIONS),
            "y_position": _one_of(Y_POSITIONS),
            "direction": _one_of(MOVE_DIRECTIONS),
        }
    )
    return _object({"parts": {"type": "array", "items": {"anyOf": [structure, drawn, relation]}}})


def _object(properties: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "type": "object", "properties": dict(properties), "required": list(properties), "additionalProperties": False,
    }  # fmt: skip


def _one_of(values: Collection[str]) -> dict[str, Any]:
    return {"type": ["string", "null"], "enum": [*values, None]}


def _or_null(schema: Mapping[str, Any]) -> dict[str, Any]:
    return {"anyOf": [schema, {"type": "null"}]}
