"""Standard output is for results alone, whatever libraries print from C; and a command ends when nobody reads it.

On both streams control characters of other people's texts are made visible; see `agent.terminal_text`.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO

from agent.terminal_text import VisibleStream, VisibleText
from structdiffusion.silence import import_pybullet_silently

__all__ = ["ReaderGone", "end_when_nobody_reads", "import_pybullet_silently", "results_stream"]


class ReaderGone(SystemExit):
    """Nobody reads the output any more: the command ends with exit code 0.

    It ends the process as `sys.exit` does, so that nothing that handles errors takes it for one.
    """


class _Output(io.FileIO):
    """A file descriptor to write to; where nobody reads it, the rest goes nowhere."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except BrokenPipeError:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            raise ReaderGone(0) from None


def _text(descriptor: int, encoding: str, errors: str, line_buffering: bool = True) -> TextIO:
    binary = io.BufferedWriter(_Output(descriptor, "wb", closefd=False))
    return VisibleText(binary, encoding, errors, line_buffering=line_buffering)


def end_when_nobody_reads() -> None:
    """Makes a write to standard output or standard error raise `ReaderGone` where the reader has closed the pipe."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed by whoever started the process
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))
            continue
        try:
            stream.flush()
            descriptor = stream.fileno()
        except (OSError, ValueError, AttributeError):  # closed, or no file
            continue
        by_lines = stream.line_buffering or stream.write_through  # the latter with PYTHONUNBUFFERED
        setattr(sys, name, _text(descriptor, stream.encoding, stream.errors, by_lines))


@contextmanager
def results_stream() -> Iterator[TextIO]:
    """Standard output for results alone: what libraries print there from C goes to standard error meanwhile."""
    sys.stdout.flush()
    try:
        descriptor = sys.stdout.fileno()
    except (OSError, ValueError, AttributeError):  # not a file: somebody captures the output in this process
        yield VisibleStream(sys.stdout)  # type: ignore[misc]  # all that is missing is the stream's
        return
    kept = os.dup(descriptor)
    os.dup2(2, descriptor)
    try:
        with _text(kept, "utf-8", "strict") as results:
            yield results
    finally:
        sys.stdout.flush()
        os.dup2(kept, descriptor)
        os.close(kept)
