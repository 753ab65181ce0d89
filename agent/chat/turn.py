"""Track one turn of a conversation: its step, its duration and its failure."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from agent import events
from agent.errors import INTERRUPTED, exit_code_of, one_sentence
from agent.event_base import Event

STOPPED = "interrupted"  # the trouble of a part that was stopped


class Turn:
    """A timer for the parts of a turn, which reports their failures.

    Args:
        send: receives the events of a failure.

    Attributes:
        step: the current step, as named in an event `Failed`.
        seconds: working time of the turn so far, without time spent waiting for the user.
        trouble: why the last failed part failed, in a sentence; empty if none failed.
    """

    def __init__(self, send: Callable[[Event], None]) -> None:
        self._send = send
        self.step, self.seconds, self.trouble = "parse", 0.0, ""

    def begin(self) -> None:
        """Begin the next turn and reset its time."""
        self.seconds = 0.0

    @contextmanager
    def part(self, step: str) -> Iterator[None]:
        """Run a part of the turn; a known error in it is sent as events and ends the part.

        Args:
            step: the step in which the part begins.
        """
        self.step, began = step, time.perf_counter()
        try:
            yield
        except (Exception, KeyboardInterrupt) as error:
            code = exit_code_of(error)
            if code is None:
                raise
            self.seconds += time.perf_counter() - began
            self.trouble = STOPPED if code == INTERRUPTED else one_sentence(error)
            self._send(events.Failed(self.step, self.trouble, code))
            self._send(events.Finished(False, code, self.seconds))
        else:
            self.seconds += time.perf_counter() - began
