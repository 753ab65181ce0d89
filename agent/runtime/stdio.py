"""Set up standard input, output and error: standard output carries only results, and closed streams end a command
cleanly.

Both output streams make control characters in foreign texts visible; see `agent.runtime.terminal_text`.
"""

from __future__ import annotations

import codecs
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO

from agent.runtime.terminal_text import VisibleStream, VisibleText
from grounding.instruction_files import encoding_of
from structdiffusion.simulation.pybullet_import import import_pybullet_silently

__all__ = [
    "NO_TEXT",
    "ReaderGone",
    "as_text",
    "end_when_nobody_reads",
    "import_pybullet_silently",
    "lines_as_they_come",
    "results_stream",
]

NO_TEXT = "\N{REPLACEMENT CHARACTER}"  # stands for a byte that is not text
LONGEST_LINE = 100_000  # characters that are kept of a line: far more than any instruction may have
_PIECE = 65_536  # bytes that are taken from a pipe at once


class ReaderGone(SystemExit):
    """The reader of the output has closed the stream: the command ends with exit code 0.

    It ends the process as `sys.exit` does, so that no error handler catches it.
    """


class _Output(io.FileIO):
    """A file descriptor to write to; after the reader has closed it or a write has failed, further output is
    discarded.

    Raises:
        ReaderGone: on a write after the reader has closed the pipe.
        OSError: on writing, once, for any other failure such as a full disk; but never for standard error, because
            there is nowhere to tell it.
    """

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except BlockingIOError:
            raise
        except OSError as error:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            if isinstance(error, BrokenPipeError):
                raise ReaderGone(0) from None
            if self.fileno() != 2:
                raise OSError(error.errno, error.strerror, "standard output") from None
            return super().write(data)


def _text(descriptor: int, encoding: str, errors: str, line_buffering: bool = True) -> TextIO:
    binary = io.BufferedWriter(_Output(descriptor, "wb", closefd=False))
    return VisibleText(binary, encoding, errors, line_buffering=line_buffering)


def end_when_nobody_reads() -> None:
    """Make a write to standard output or standard error raise `ReaderGone` if the reader has closed the pipe."""
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:  # closed by whoever started the process: the next file that is opened would take its place
            nowhere = os.open(os.devnull, os.O_RDWR)
            assert nowhere == descriptor  # the lowest that is free
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed by whoever started the process
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115 - a standard stream
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
    """Reserve standard output for results; output that libraries print there from C goes to standard error
    meanwhile.
    """
    sys.stdout.flush()
    try:
        descriptor = sys.stdout.fileno()
    except (OSError, ValueError, AttributeError):  # not a file: somebody captures the output in this process
        yield VisibleStream(sys.stdout)  # type: ignore[misc]  # all that is missing is the stream's
        return
    kept = os.dup(descriptor)
    os.dup2(2, descriptor)
    try:
        # File names may have bytes that are no text; they are told as \xff and stop nothing.
        with _text(kept, "utf-8", "backslashreplace") as results:
            yield results
    finally:
        sys.stdout.flush()
        os.dup2(kept, descriptor)
        os.close(kept)


def lines_as_they_come(stream: TextIO, keep_blank: bool = False) -> Iterator[list[str]]:
    """Yield the lines of a stream without their ends, in batches of those available; wait only for the first of a
    batch.

    A byte order mark decides the encoding. Bytes that are not text in it become `NO_TEXT`, and of a line longer than
    `LONGEST_LINE` only the beginning is kept, so that no input takes memory without end.

    Args:
        stream: a text stream over bytes, such as `sys.stdin`.
        keep_blank: also yield blank lines.
    """
    source: Any = stream.buffer  # buffered: it hands over what there is
    begun, piece, decoder = "", b"more", None
    while piece:
        piece = source.read1(_PIECE)
        mark = 0
        if decoder is None:
            encoding, mark = encoding_of(piece)
            encoding = stream.encoding if encoding == "utf-8" and not mark else encoding
            decoder = io.IncrementalNewlineDecoder(codecs.getincrementaldecoder(encoding)("replace"), translate=True)
        *whole, begun = (begun + decoder.decode(piece[mark:], final=not piece)).split("\n")
        begun = begun[:LONGEST_LINE]
        if not piece and begun:  # the last line, without an end
            whole.append(begun)
        lines = [line[:LONGEST_LINE] for line in whole if keep_blank or line.strip()]
        if lines:
            yield lines


def as_text(argument: str) -> str:
    """Return an argument of the command line with the bytes that are not UTF-8 replaced by `NO_TEXT`."""
    return argument.encode("utf-8", "surrogateescape").decode("utf-8", "replace")
