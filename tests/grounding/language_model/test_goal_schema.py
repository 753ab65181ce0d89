"""The schema of a reply holds all legal goals, and keeps to what strict servers take."""

import json

import fastjsonschema
import pytest

from grounding.goals.goal import Goal
from grounding.language_model.goal_schema import DECISIONS, reply_schema

NOTHING = {"decision": "none", "goal": None, "question": None, "options": [], "reason": None}


def schemas(schema):
    """Every schema within a schema."""
    if isinstance(schema, dict):
        if "type" in schema or "anyOf" in schema:
            yield schema
        for value in schema.values():
            yield from schemas(value)
    elif isinstance(schema, list):
        for value in schema:
            yield from schemas(value)


@pytest.mark.parametrize("count", [None, 4])
def test_the_schema_is_strict(count):
    found = list(schemas(reply_schema(count)))
    assert len(found) > 50
    for schema in found:
        assert set(schema) <= {"type", "anyOf", "enum", "items", "properties", "required", "additionalProperties"}
        if schema.get("type") == "object":
            assert schema["required"] == list(schema["properties"]) and schema["additionalProperties"] is False


def test_every_decision_fits():
    legal = fastjsonschema.compile(reply_schema(2))
    for decision in DECISIONS:
        legal(NOTHING | {"decision": decision, "options": ["left", {"parts": []}], "reason": "so"})
    with pytest.raises(fastjsonschema.JsonSchemaException):
        legal(NOTHING | {"decision": "perhaps"})


@pytest.mark.parametrize(
    "part",
    [
        {"kind": "structure", "shape": "grid", "rows": 3, "columns": 2, "gap": 0.05},
        {"kind": "structure", "shape": "line", "objects": [0, 1], "order": {"by": "listed", "from": "near"}},
        {"kind": "structure", "shape": "circle", "objects": [0], "radius": 0.15, "around": [1]},
        {"kind": "structure", "shape": "cluster", "group_by": "colour"},
        {"kind": "relation", "relation": "moved", "objects": [0], "direction": "closer", "distance": 0.1},
        {"kind": "relation", "relation": "at", "objects": [0], "x_position": "left", "y_position": "top"},
        {"kind": "relation", "relation": "between", "objects": [0], "reference": [1, 2]},
    ],
)
def test_every_goal_fits(part):
    goal = Goal.from_dict({"parts": [part]}).to_dict()
    fastjsonschema.compile(reply_schema(3))(NOTHING | {"decision": "build", "goal": goal})
    words = json.loads(json.dumps(goal))
    for key in ("objects", "reference", "around"):
        if isinstance(words["parts"][0].get(key), list):
            words["parts"][0][key] = ["the mug"] * len(words["parts"][0][key])
    fastjsonschema.compile(reply_schema(None))(NOTHING | {"decision": "build", "goal": words})
