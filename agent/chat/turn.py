"""Track one turn of a conversation: its step, its duration, and how it fails."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from agent import events
from agent.errors import INTERRUPTED, exit_code_of, one_sentence
from agent.event_base import Event


class Turn:
    """Times the parts of a turn, and reports what goes wrong in them.

    Args:
        send: gets the events of a failure.

    Attributes:
        step: the step that the turn is in, as an event `Failed` names it.
        seconds: how long the turn has worked so far; time spent waiting for the user does not count.
        trouble: why the last part that failed did, in a sentence; empty before that.
    """

    def __init__(self, send: Callable[[Event], None]) -> None:
        self._send = send
        self.step, self.seconds, self.trouble = "parse", 0.0, ""

    def begin(self) -> None:
        """Begin the next turn: no time has passed in it."""
        self.seconds = 0.0

    @contextmanager
    def part(self, step: str) -> Iterator[None]:
        """Run a part of the turn: a known error in it is sent as events and ends the part.

        Args:
            step: in which the part begins.
        """
        self.step, began = step, time.perf_counter()
        try:
            yield
        except (Exception, KeyboardInterrupt) as error:
            code = exit_code_of(error)
            if code is None:
                raise
            self.seconds += time.perf_counter() - began
            self.trouble = "interrupted" if code == INTERRUPTED else one_sentence(error)
            self._send(events.Failed(self.step, self.trouble, code))
            self._send(events.Finished(False, code, self.seconds))
        else:
            self.seconds += time.perf_counter() - began
