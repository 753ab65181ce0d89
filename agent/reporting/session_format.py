"""Define the lines of session files: their layout, their schema versions, and their conversion to bytes and back.

The first line describes the session; it is repeated where a later process continues the file:

    {"schema_version": 7, "version": "0.1.0", "started": "2025-01-31T09:30:00+00:00", "options": {...}, "machine": ...}

Every other line is an event (its payload, see `agent.event_base`), a picture, or a part of the table in 3D (see
`agent.reporting.table_model`); `seconds` count from the latest start:

    {"seconds": 1.25, "event": {"kind": "started", "instruction": "stack the cans", "options": {...}}}
    {"seconds": 2.5, "picture": {"name": "scene-before", "caption": "...", "format": "webp", "data": "<base64>"}}
    {"seconds": 2.5, "table": {"candidates": [...]}}

An event `started` begins a turn. In version 1 the `display_name` of an object was called `called`. Up to version 2
every goal was one structure: the event `parsed` had no `goal`, `parts` and `objects`, and `restored` no `parts`. Up to
version 3 the event `proposed` was called `imagined`, its picture `imagined-goal`, its step `imagination`, and the score
`rollout` was called `imagined`; `checked` had no `count` and no `left_out`. Up to version 4 there was no table in 3D.
Up to version 5 the event `placed` did not say whether the object stands (`trouble`), why it was moved `again`, and what
it was to rest `on`, and a seen object had no `number`. Up to version 6 there were no events `interjected`, `remembered`
and `forked`, and `restored` did not say which `turn` of the timeline is the present one.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from grounding.goals.goal import Goal
from grounding.spec import SLOTS, SpecError

SCHEMA_VERSION = 7
READABLE_VERSIONS = (1, 2, 3, 4, 5, 6, 7)


def encode_line(entry: Mapping[str, Any]) -> bytes:
    """Return the line of a session file that holds `entry`."""
    return json.dumps(entry, ensure_ascii=False, allow_nan=False).encode("utf-8", errors="replace") + b"\n"


def decode_line(line: bytes) -> Any:
    """Return the JSON value of a line, or `None` if the line is not JSON."""
    try:
        return json.loads(line)
    except (ValueError, RecursionError):  # a UnicodeDecodeError is a ValueError too
        return None


def is_start(entry: Any) -> bool:
    """Return whether this is the first line of a session, in any schema version."""
    return (
        isinstance(entry, dict)
        and {"schema_version", "version", "started", "machine"} <= entry.keys()
        and (isinstance(entry["started"], str) and isinstance(entry.get("options"), dict))
    )


def upgrade_payload(payload: Any, schema_version: int) -> Any:
    """Return an event's payload in the current schema version.

    Args:
        payload: the JSON value that was read, of any type.
        schema_version: the version in which it was written, one of `READABLE_VERSIONS`.
    """
    if schema_version == SCHEMA_VERSION or not isinstance(payload, dict):
        return payload
    payload = _with_proposals(payload)
    match payload.get("kind"):
        case "perceived" if isinstance(payload.get("objects"), list):
            return payload | {"objects": [_with_display_name(one) for one in payload["objects"]]}
        case "placed":
            return {"trouble": "", "again": "", "on": ""} | payload
        case "parsed" if schema_version <= 2:
            return {"goal": _goal_of_slots(payload.get("spec")), "parts": [], "objects": []} | payload
        case "restored":
            return {"parts": [], "turn": None} | payload
        case "checked":
            return {"count": 0, "left_out": []} | payload
    return payload


def upgrade_picture_name(name: str, schema_version: int) -> str:
    """Return the name of a picture in the current schema version."""
    return "proposed-goal" if schema_version <= 3 and name == "imagined-goal" else name


def _with_proposals(payload: dict[str, Any]) -> dict[str, Any]:
    """Return an event of version 3 or earlier with the present names of proposals, their step and their scores."""
    match payload.get("kind"):
        case "imagined":
            candidates = payload.get("candidates")
            if isinstance(candidates, list):
                candidates = [_with_rollout(one) for one in candidates]
            return payload | {"kind": "proposed", "candidates": candidates}
        case "chosen":
            return _with_rollout(payload)
        case "failed" if payload.get("step") == "imagination":
            return payload | {"step": "propose"}
    return payload


def _with_rollout(scored: Any) -> Any:
    if not isinstance(scored, dict) or not isinstance(scored.get("scores"), dict):
        return scored
    scores = {("rollout" if key == "imagined" else key): value for key, value in scored["scores"].items()}
    return scored | {"scores": scores}


def _goal_of_slots(spec: Any) -> dict[str, Any]:
    """Return the goal of one structure; empty if the slots are invalid, which the check of the payload reports."""
    try:
        return Goal.from_dict({slot: spec.get(slot) for slot in SLOTS}).to_dict()
    except (AttributeError, TypeError, SpecError):
        return Goal().to_dict()


def _with_display_name(seen: Any) -> Any:
    if not isinstance(seen, dict):
        return seen
    return {"number": 0} | {("display_name" if key == "called" else key): value for key, value in seen.items()}
