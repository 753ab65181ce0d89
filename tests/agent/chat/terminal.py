"""A terminal for tests: a real pseudo-terminal with a program in it, and a screen that shows what one would see."""

from __future__ import annotations

import os
import re
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pexpect
import pyte

from tests.commands import structagent

ROOT = Path(__file__).parents[3]
LONGEST = 600.0  # s, until a test that waits in vain is given up; nothing is asked to be quick
PROMPT = re.compile(r"(?:>|build it\? \[y/n\] >|1-\d+>)")


class Terminal:
    """`structagent` with arguments, in a terminal of a size.

    Attributes:
        raw: everything that it has written, control sequences included.
    """

    def __init__(self, arguments: list[str], home: Path, columns: int = 80, rows: int = 50, **environment: str) -> None:
        kept = {name: value for name, value in os.environ.items() if not name.startswith("STRUCTAGENT_")}
        environment = {
            **kept,
            "TERM": "xterm-256color",
            "COLORTERM": "truecolor",
            "XDG_STATE_HOME": str(home),
            "XDG_CONFIG_HOME": str(home),
            "PROMPT_TOOLKIT_NO_CPR": "1",
            "PYTHONPATH": str(ROOT),
            **environment,
        }
        environment.pop("NO_COLOR", None)
        command, *arguments = structagent(*arguments)
        self._child = pexpect.spawn(
            command,
            arguments,
            dimensions=(rows, columns),
            env=environment,
            encoding="utf-8",
            timeout=LONGEST,
            cwd=str(home),
            # Whoever runs the tests in the background ignores Ctrl-C, and so would everything that they start.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        self._screen = pyte.HistoryScreen(columns, rows, history=5000)
        self._stream = pyte.Stream(self._screen)
        self.raw = ""

    def __enter__(self) -> Terminal:
        return self

    def __exit__(self, *_: object) -> None:
        self._child.close(force=True)

    def _read(self, seconds: float) -> bool:
        try:
            piece = self._child.read_nonblocking(65536, seconds)
        except (pexpect.TIMEOUT, pexpect.EOF):
            return False
        self.raw += piece
        self._stream.feed(piece)
        return True

    def lines(self) -> list[str]:
        """Everything that was shown, what has scrolled away included, without colours."""
        columns = range(self._screen.columns)
        above = ["".join(row[column].data for column in columns) for row in self._screen.history.top]
        return [line.rstrip() for line in (*above, *self._screen.display)]

    def screen_rows(self) -> list[list[pyte.screens.Char]]:
        """The same, as cells."""
        rows = [*self._screen.history.top, *(self._screen.buffer[row] for row in range(self._screen.lines))]
        return [[row[column] for column in range(self._screen.columns)] for row in rows]

    def clear(self) -> None:
        """Forgets what was shown so far."""
        self._screen.history.top.clear()
        self._screen.erase_in_display(2)

    def waits(self) -> bool:
        """Whether the cursor stands behind a prompt with nothing typed."""
        return PROMPT.fullmatch(self._line()) is not None

    def _line(self) -> str:
        row = self._screen.buffer[self._screen.cursor.y]
        return "".join(row[column].data for column in range(self._screen.columns)).rstrip()

    def until_prompt(self) -> list[str]:
        """Reads until the next prompt waits; everything that was shown."""
        self._wait(self.waits, "a prompt")
        while self._read(0.2):  # what belongs to the same picture
            pass
        return self.lines()

    def until(self, pattern: str) -> None:
        """Reads until a line of what is shown matches, which has to be before the next prompt waits."""
        self._wait(lambda: self._shows(pattern) or self.waits(), repr(pattern))
        assert self._shows(pattern), f"{pattern!r} was not shown before the prompt: {self._end()}"

    def _shows(self, pattern: str) -> bool:
        return any(re.search(pattern, line) for line in self.lines())

    def _end(self) -> str:
        return "\n".join(self.lines()[-30:])

    def type(self, line: str) -> None:
        """Types a line, and Enter when it is shown: from then on no prompt waits until the next one is there."""
        self._child.send(line)
        echo = re.compile(rf"{PROMPT.pattern} {re.escape(line)}")
        self._wait(lambda: echo.match(self._line()) is not None, f"the echo of {line!r}")
        self._child.send("\r")

    def interject(self, line: str) -> None:
        """Types a line and Enter while there is no prompt."""
        self._child.send(f"{line}\r")

    def _wait(self, shown: Callable[[], bool], what: str) -> None:
        """Reads until something is shown."""
        deadline = time.monotonic() + LONGEST
        while not shown():
            if not self._read(1.0) and (time.monotonic() > deadline or not self._child.isalive()):
                raise AssertionError(f"{what} was not shown; the end of the screen: {self._end()}")

    def interrupt(self) -> None:
        """Ctrl-C."""
        self._child.sendintr()

    def end(self) -> int:
        """Ctrl-D; the exit code."""
        self._child.sendeof()
        while self._read(0.5) or self._child.isalive():
            pass
        self._child.close()
        return self._child.exitstatus if self._child.exitstatus is not None else -self._child.signalstatus
