"""Supply what is said while the arm builds: typed at that moment, or written down for a number of placements."""

from __future__ import annotations

import re
import select
from collections.abc import Callable
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Protocol, TextIO

from agent.runtime.stdio import LONGEST_LINE

_MARK = re.compile(r"@(?P<placed>\d{1,4})(?P<holding>\+)?\s+(?P<line>\S.*)")


@dataclass(frozen=True)
class Moment:
    """How far a build has come.

    Attributes:
        placed: how many placements there were.
        holding: whether an object is in the hand.
        waiting: whether the arm waits to be told to go on.
    """

    placed: int = 0
    holding: bool = False
    waiting: bool = False


class Source(Protocol):
    """Whoever says something while the arm builds."""

    @property
    def silent(self) -> bool:
        """Return whether nothing more can come."""

    def next(self, moment: Moment) -> str | None:
        """Return the next line that was said by this moment, at once; `None` if there is none."""


class Silence:
    """Nobody says anything."""

    silent = True

    def next(self, moment: Moment) -> None:
        """Return nothing."""


@dataclass(frozen=True)
class Interjection:
    """A line that is said at a moment of a build, whatever the clock says.

    Attributes:
        line: what is said.
        placed: after how many placements.
        holding: only once the next object is in the hand.
    """

    line: str
    placed: int
    holding: bool = False

    @classmethod
    def parse(cls, text: str) -> Interjection | None:
        """Return the interjection that a line such as "@2 on the left instead" stands for, or `None`: "@2" is after the
        second placement, "@2+" once the third object is in the hand.
        """
        found = _MARK.fullmatch(text.strip())
        return None if found is None else cls(found["line"], int(found["placed"]), bool(found["holding"]))

    def is_due(self, moment: Moment) -> bool:
        """Return whether it is time to say it; where the arm waits, nothing would come later."""
        late = moment.placed > self.placed or (moment.placed == self.placed and (moment.holding or not self.holding))
        return late or moment.waiting


class Script:
    """Interjections that were written down, said in their order.

    Args:
        lines: the interjections.
        said: called with each line when it is said.
    """

    def __init__(self, lines: list[Interjection], said: Callable[[str], object] = lambda line: None) -> None:
        self._lines, self._said = list(lines), said

    @property
    def silent(self) -> bool:
        """Return whether everything was said."""
        return not self._lines

    def next(self, moment: Moment) -> str | None:
        """Return the first line that was not said yet, if it is due."""
        if not self._lines or not self._lines[0].is_due(moment):
            return None
        line = self._lines.pop(0).line
        self._said(line)
        return line

    def rest(self) -> list[str]:
        """Return what was not said, because the build ended before; it is not said by this any more."""
        rest, self._lines = [one.line for one in self._lines], []
        return rest


class Typed:
    """Lines that are typed at a terminal; it is looked at, and nobody waits for it.

    Args:
        terminal: the stream, whose lines come whole.
    """

    def __init__(self, terminal: TextIO) -> None:
        self._terminal = terminal
        self.silent = False

    def next(self, moment: Moment) -> str | None:
        """Return the next line that was typed."""
        if self.silent or not select.select([self._terminal], [], [], 0)[0]:
            return None
        line = self._terminal.readline(LONGEST_LINE)
        self.silent = not line
        return "".join(char if char.isprintable() else " " for char in line) if line else None


class Queued:
    """Lines that other threads put in."""

    silent = False

    def __init__(self) -> None:
        self._lines: SimpleQueue[str] = SimpleQueue()

    def put(self, line: str) -> None:
        """Say a line, from any thread."""
        self._lines.put(line)

    def next(self, moment: Moment) -> str | None:
        """Return the next line that was put in."""
        try:
            return self._lines.get_nowait()
        except Empty:
            return None
