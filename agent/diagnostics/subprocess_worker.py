"""Run work that may crash, hang or print in a separate process, so that the caller always continues.

The tasks of a list share one process, so that what they import is imported once; the process is replaced when a task
brings it down. This module needs only the standard library.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

WORKER = Path(__file__).with_name("probes.py")


@dataclass(frozen=True)
class Outcome:
    """The result of a task.

    Attributes:
        task: the name of the task.
        works: whether it ended without an error.
        said: what it reports, or what went wrong, on one line.
        absent: the module or shared library that could not be found, or empty.
        crashed: whether it crashed its process, or was stopped because it hung.
    """

    task: str
    works: bool
    said: str
    absent: str = ""
    crashed: bool = False


def carry_out(tasks: Sequence[str], seconds: float, worker: Path = WORKER) -> Iterator[Outcome]:
    """Yield the outcome of every task, in order, as soon as it is known.

    Args:
        tasks: names that the worker knows. An "import NAME" that brought its process down is a module that later
            tasks do not find, so that they fail at once and do not crash or hang likewise.
        seconds: how long one task may take.
        worker: the program; given the names of modules that it must not find, it reads a task a line from standard
            input and answers each with a line of JSON on standard output.
    """
    poisoned: list[str] = []
    process: _Process | None = None
    try:
        for task in tasks:
            process = process or _Process(worker, poisoned)
            outcome = process.ask(task, seconds)
            yield outcome
            if outcome.crashed:
                process.end()
                process = None
                if task.startswith("import "):
                    poisoned.append(task.removeprefix("import "))
    finally:
        if process is not None:
            process.end()


class _Process:
    def __init__(self, worker: Path, poisoned: Sequence[str]) -> None:
        # The same modules as in this process, and not those that happen to lie in the current folder.
        path = os.pathsep.join(entry for entry in sys.path if entry)
        self._complaints: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
        self._process = subprocess.Popen(
            [sys.executable, "-P", str(worker), *poisoned],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._complaints,
            env={**os.environ, "PYTHONPATH": path},
            start_new_session=True,  # to be ended with everything that it started
        )
        self._answers: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        assert self._process.stdout is not None
        with suppress(ValueError, OSError):  # closed meanwhile
            for line in self._process.stdout:
                self._answers.put(line)
        self._answers.put(b"")

    def ask(self, task: str, seconds: float) -> Outcome:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(task.encode() + b"\n")
            self._process.stdin.flush()
            line = self._answers.get(timeout=seconds)
        except queue.Empty:
            return Outcome(task, False, f"hangs: it was stopped after {seconds:g} s", crashed=True)
        except OSError:  # the process ended before it could be asked
            line = b""
        try:
            answer: dict[str, Any] = json.loads(line)
            return Outcome(task, bool(answer["works"]), str(answer["said"]), str(answer.get("absent") or ""))
        except (ValueError, KeyError, TypeError):
            return Outcome(task, False, self._end_of_process(), crashed=True)

    def _end_of_process(self) -> str:
        try:
            code = self._process.wait(10)
        except subprocess.TimeoutExpired:
            return "gives an unexpected answer"
        if code >= 0:
            self._complaints.seek(0)
            last = self._complaints.read().decode(errors="replace").strip().splitlines()[-1:]
            return f"ends the process with exit code {code}" + "".join(f" ({line[:200]})" for line in last)
        try:
            return f"crashes ({signal.Signals(-code).name})"
        except ValueError:
            return f"crashes (signal {-code})"

    def end(self) -> None:
        with suppress(OSError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout, self._complaints):
            with suppress(OSError):
                stream.close()  # type: ignore[union-attr]
