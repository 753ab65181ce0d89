"""Check that a JSON object is the payload of an event, by the fields of the events themselves.

Listeners may then rely on every key, type and count.
"""

from __future__ import annotations

import types
import typing
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np

from agent import events
from agent.arm import events as arm_events
from agent.arm.events import ArmEvent
from agent.event_base import in_payload, kind_of

_LARGEST = 1e9  # of any length, angle or time; more is no measurement
_MAY_BE_NULL = (".measured", ".scores.")  # numbers that may be none: nothing could be measured


@cache
def event_classes() -> dict[str, type]:
    """Return every event by its kind."""
    classes = [
        one
        for module in (events, arm_events)
        for one in vars(module).values()
        if is_dataclass(one) and isinstance(one, type) and hasattr(one, "to_dict") and one is not ArmEvent
    ]
    return {kind_of(object.__new__(one)): one for one in classes}  # a kind follows from the class alone


def payload_error(payload: object) -> str | None:
    """Describe the error in an event's payload, in words that continue "line 3: "; `None` if it is valid."""
    if not isinstance(payload, Mapping) or not isinstance(payload.get("kind"), str):
        return 'an event must be an object with a "kind"'
    event = event_classes().get(payload["kind"])
    if event is None:
        return f"{payload['kind']!r} is not an event; there are {', '.join(sorted(event_classes()))}"
    return misfit(payload, event, payload["kind"])


def payload_conflict(payload: Mapping[str, Any], part: int) -> str | None:
    """Describe how a payload that `payload_error` accepts contradicts the earlier events; `None` if it does not.

    Args:
        payload: the event.
        part: the number of participants in the last observation.
    """
    match payload["kind"]:
        case "tried":
            for key in ("positions", "turns"):
                if len(payload[key]) != part:
                    return f"tried.{key} must have {part} entries, one for each object"
        case "proposed":
            for number, candidate in enumerate(payload["candidates"]):
                for key in ("positions", "turns"):
                    if len(candidate[key]) != part and (key == "positions" or candidate[key]):  # turns may be untold
                        return f"proposed.candidates[{number}].{key} must have {part} entries, one for each object"
        case "chosen":
            for number, goal in enumerate(payload["goals"]):
                where = f"chosen.goals[{number}]"
                position = misfit(goal.get("position"), tuple[float, float, float], f"{where}.position")
                problem = misfit(goal.get("name"), str, f"{where}.name") or position
                problem = problem or misfit(goal.get("parts", []), tuple[int, ...], f"{where}.parts")
                if problem:
                    return problem
        case "planned":
            if len(payload["order"]) != len(payload["grasps"]):
                return "planned.grasps must have as many entries as planned.order"
            if not all(0 <= index < part for index in payload["order"]):
                return f"planned.order must have numbers from 0 that are less than {part}, the number of objects"
    return None


@cache
def _hints(kind: type) -> dict[str, Any]:
    return typing.get_type_hints(kind)


def misfit(value: Any, hint: Any, where: str) -> str | None:
    """Describe why a JSON value is not a `hint`, in words that begin with its place; `None` if it is one.

    Args:
        value: the JSON value.
        hint: a type: a dataclass of such types, a union, tuple or mapping of them, or a plain one.
        where: the words for its place.
    """
    if isinstance(hint, type) and is_dataclass(hint):
        if not isinstance(value, Mapping):
            return f"{where} must be an object"
        for entry in fields(hint):
            if not in_payload(entry.metadata):
                continue
            inside = f"{where}.{entry.name}"
            if entry.name in value:
                problem = misfit(value[entry.name], _hints(hint)[entry.name], inside)
                if problem:
                    return problem
            else:
                return f"{inside} is missing"
        return None
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        problems = [misfit(value, one, where) for one in inner]
        return None if None in problems else problems[0]
    if origin is tuple:
        if not isinstance(value, list):
            return f"{where} must be a list"
        every = inner[-1] is Ellipsis
        if not every and len(value) != len(inner):
            return f"{where} must have {len(inner)} entries"
        members = [inner[0]] * len(value) if every else inner
        problems = [misfit(one, member, f"{where}[{k}]") for k, (one, member) in enumerate(zip(value, members))]
        return next((problem for problem in problems if problem), None)
    if origin is not None and issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            return f"{where} must be an object"
        problems = [misfit(one, inner[1], f"{where}.{name}") for name, one in value.items()]
        return next((problem for problem in problems if problem), None)
    legal, named = _PLAIN[hint]
    fits = isinstance(value, legal) and (hint in (bool, Any) or not isinstance(value, bool))
    if hint is float and value is None:
        fits = any(part in f"{where}." for part in _MAY_BE_NULL)
    elif hint is float and fits:
        fits = abs(value) < _LARGEST  # which no NaN is
    return None if fits else f"{where} must be {named}"


_PLAIN: dict[Any, tuple[Any, str]] = {
    float: ((int, float), "a number"),
    int: (int, "a whole number"),
    bool: (bool, "true or false"),
    str: (str, "a string"),
    types.NoneType: (types.NoneType, "null"),
    np.ndarray: (list, "a list"),
    Any: (object, "anything"),
}
