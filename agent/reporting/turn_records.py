"""Record the turns of a conversation: every event and its pictures go to the session, with one record per turn."""

from __future__ import annotations

from agent.event_base import Event, kind_of
from agent.reporting.run_report import RunRecord
from agent.reporting.session_log import SessionWriter


class TurnRecords:
    """A listener that writes every event and its pictures to a session, and keeps the records of the last turns.

    Args:
        writer: the session.
        keep: how many records are kept.

    Attributes:
        count: how many turns there were.
    """

    def __init__(self, writer: SessionWriter, keep: int = 1) -> None:
        self._writer, self._keep = writer, keep
        self._records = {0: RunRecord(writer)}  # 0: what happens before the first turn
        self.count = 0

    def on_event(self, event: Event) -> None:
        """Record one event; "started" begins a turn."""
        if kind_of(event) == "started":
            self.count += 1
            self._records[self.count] = RunRecord(self._writer)
            if len(self._records) > self._keep:
                del self._records[next(iter(self._records))]
        self._records[self.count].on_event(event)

    def turn(self, number: int) -> RunRecord | None:
        """Return the record of a turn, from 1; `None` if there is none, or none any more."""
        return self._records.get(number)
