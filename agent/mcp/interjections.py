"""Pass what a client says while the arm builds to the thread that builds, and what came of it back."""

from __future__ import annotations

from concurrent.futures import Future
from queue import Empty, SimpleQueue

from agent.chat.interjections import Moment
from agent.errors import UsageError
from agent.event_base import Event

MOST_WAITING = 16  # lines that are not read yet
ENDED = "the build has ended meanwhile; call propose"


class SaidByClients:
    """A source of lines for a build, whose callers get the events that come of their line."""

    silent = False

    def __init__(self) -> None:
        self._waiting: SimpleQueue[tuple[str, Future[list[Event]]]] = SimpleQueue()
        self._answered: Future[list[Event]] | None = None
        self._heard: list[Event] = []

    def say(self, line: str) -> Future[list[Event]]:
        """Say a line, from any thread; return the events to come.

        The future raises `UsageError` if the build ends before the line is read.

        Raises:
            UsageError: if too many lines wait to be read.
        """
        if self._waiting.qsize() >= MOST_WAITING:
            raise UsageError(f"{MOST_WAITING} lines wait to be read; try again later")
        answer = Future[list[Event]]()
        self._waiting.put((line, answer))
        return answer

    def next(self, moment: Moment) -> str | None:
        """Return the next line; the one before has been carried out by now."""
        self._tell()
        try:
            line, self._answered = self._waiting.get_nowait()
        except Empty:
            return None
        self._heard = []
        return line

    def hear(self, event: Event) -> None:
        """Take an event of the build."""
        if self._answered is not None:
            self._heard.append(event)

    def close(self) -> None:
        """End with the build."""
        self._tell()
        while not self._waiting.empty():
            self._waiting.get_nowait()[1].set_exception(UsageError(ENDED))

    def _tell(self) -> None:
        if self._answered is not None:
            self._answered.set_result(self._heard)
            self._answered = None
