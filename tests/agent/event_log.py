"""A listener that keeps what it gets."""

from __future__ import annotations

from agent.event_base import Event


class EventLog(list[Event]):
    """The events that it got, in order."""

    def on_event(self, event: Event) -> None:
        self.append(event)
