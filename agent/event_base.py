"""Define what all events share: their JSON form, and the interface of their listeners."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np


class Event(Protocol):
    """An event while an instruction is carried out, live or read from a session file."""

    def to_dict(self) -> dict[str, Any]:
        """Return the event's payload: its JSON form, with its kind and its fields."""


class Listener(Protocol):
    """A receiver of events: a screen, a report, a file."""

    def on_event(self, event: Event) -> None:
        """Process one event. Events arrive in the order in which they happen."""


def send(event: Event, listeners: Iterable[Listener]) -> None:
    """Send an event to every listener, in order."""
    for listener in listeners:
        listener.on_event(event)


class EventBase:
    """A base of dataclasses that builds their payload: the kind, and every field that is not `live_only`."""

    def to_dict(self) -> dict[str, Any]:
        """Return the event's payload."""
        return {"kind": kind_of(self)} | {
            entry.name: json_value(getattr(self, entry.name))
            for entry in fields(self)  # type: ignore[arg-type]
            if in_payload(entry.metadata)
        }


@dataclass(frozen=True)
class RecordedEvent:
    """An event from a session file, which has only its payload."""

    payload: Mapping[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """Return the payload as it was recorded."""
        return dict(self.payload)


def live_only(**keywords: Any) -> Any:
    """Declare a field that is left out of the payload, such as pictures and clouds."""
    return field(metadata={"payload": False}, **keywords)


def in_payload(metadata: Mapping[str, Any]) -> bool:
    """Return whether a field with this metadata is part of its event's payload."""
    return metadata.get("payload", True)


def kind_of(event: object) -> str:
    """Return the event's name in its payload: `PlanFailed` is "plan_failed"."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", type(event).__name__).lower()


def json_value(value: Any) -> Any:
    """Convert `value` to JSON: arrays to lists, dataclasses to objects, numbers that are not finite to `null`."""
    if isinstance(value, float | np.floating):
        return round(float(value), 6) if math.isfinite(value) else None
    if isinstance(value, np.bool_ | np.integer | np.ndarray):
        return json_value(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): json_value(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [json_value(entry) for entry in value]
    if is_dataclass(value) and not isinstance(value, type):
        return {entry.name: json_value(getattr(value, entry.name)) for entry in fields(value)}
    if isinstance(value, Path):
        return str(value)
    return value
