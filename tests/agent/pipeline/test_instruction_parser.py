"""`structagent parse` on a stream: every line is answered as it is read, and kept."""

import io
import json
import os
import signal
import subprocess
from pathlib import Path

import pytest

from agent.cli.parse import AT_ONCE, parse_instructions
from agent.pipeline import instruction_parser
from agent.pipeline.instruction_parser import ReadingOptions
from agent.runtime.stdio import LONGEST_LINE, NO_TEXT, lines_as_they_come
from grounding.benchmark import free_rows
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.propose.network import NetworkProposer
from tests.commands import structagent

ROOT = Path(__file__).parents[3]


class Pieces(io.RawIOBase):
    """A pipe into which the given pieces were written one after another; counts how many have been taken."""

    encoding = "utf-8"

    def __init__(self, *pieces: bytes) -> None:
        self._pieces, self.taken, self.buffer = list(pieces), 0, self

    def read1(self, size: int) -> bytes:
        self.taken += 1
        return self._pieces.pop(0) if self._pieces else b""


def lines_of(*pieces: bytes, keep_blank: bool = False) -> list[list[str]]:
    return list(lines_as_they_come(Pieces(*pieces), keep_blank))


def test_lines_come_as_they_are_written():
    stream = Pieces(b"make a line\nst", b"ack the cans\n", b"")
    lines = lines_as_they_come(stream)
    assert (next(lines), stream.taken) == (["make a line"], 1)  # and nobody waited for more
    assert next(lines) == ["stack the cans"]


@pytest.mark.parametrize(
    ("pieces", "expected"),
    [
        ([], []),
        ([b"\n \n"], []),
        ([b"a circle"], [["a circle"]]),
        ([b"a\r\n\r\nb\r", b"\nc\n"], [["a"], ["b", "c"]]),
        ([b"caf\xc3", b"\xa9\n"], [["café"]]),
        ([b"a \xff line\n"], [[f"a {NO_TEXT} line"]]),
        ([b"caf\xc3"], [[f"caf{NO_TEXT}"]]),
        ([b"\xef\xbb\xbf", b"a\nb\n"], [["a", "b"]]),
        (["a café\n".encode("utf-16"), "b".encode("utf-16-le")], [["a café"], ["b"]]),
        (["a café\nb".encode("utf-16-be")], [["a café"], ["b"]]),
    ],
)
def test_lines_of_a_pipe(pieces, expected):
    assert lines_of(*pieces) == expected


def test_blank_lines_are_kept_where_lines_are_counted_off():
    assert lines_of(b"a\n\nb\n", keep_blank=True) == [["a", "", "b"]]


def test_a_line_without_end_takes_no_memory_without_end():
    pieces = [b"a" * 60_000] * 20
    ((line, after),) = lines_of(*pieces, b"\nmake a line\n")
    assert (len(line), after) == (LONGEST_LINE, "make a line")


class Counting:
    """An interpreter of its own: notes how many texts it gets at once."""

    def __init__(self) -> None:
        self.given: list[int] = []

    def interpret_many(self, texts, names):
        self.given.append(len(texts))
        return []


def test_so_many_are_read_at_once_and_a_language_model_reads_one_by_one(monkeypatch):
    for parser, given in (("embedding", [AT_ONCE, 3]), ("llm", [1] * (AT_ONCE + 3))):
        counting = Counting()
        monkeypatch.setattr(instruction_parser, "make_interpreter", lambda options, counting=counting: counting)
        parse_instructions([["a line"] * (AT_ONCE + 3)], ReadingOptions(parser), None, True, io.StringIO(), print)
        assert counting.given == given


def test_a_stream_is_read_with_little_padding(monkeypatch):
    """Padding costs the network as much as words: of these sentences, 32 at once in any order, it was 35 %.

    Goals are left out, which are proposed for one text after the other.
    """
    monkeypatch.setattr(NetworkProposer, "propose", lambda *_: ())
    pieces, padding = 0, 0
    states = SentenceEncoder.token_states

    def counted(encoder, texts, layer=None):
        nonlocal pieces, padding
        found = states(encoder, texts, layer)
        pieces, padding = pieces + found.mask.size, padding + int((~found.mask).sum())
        return found

    monkeypatch.setattr(SentenceEncoder, "token_states", counted)
    texts = [row.text for row in free_rows()[:256]]
    results = io.StringIO()
    parse_instructions([texts], ReadingOptions(), None, True, results, lambda sentence: None)
    assert [json.loads(line)["text"] for line in results.getvalue().splitlines()] == texts  # in their order
    assert padding < 0.25 * pieces


def test_every_line_is_answered_while_others_are_still_to_come_and_kept_at_ctrl_c():
    process = subprocess.Popen(
        structagent("parse", "--json"), stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    for text, shape in (("make a line", "line"), ("stack the cans", "tower")):
        process.stdin.write(f"{text}\n")
        process.stdin.flush()
        assert json.loads(process.stdout.readline())["spec"]["shape"] == shape
    process.send_signal(signal.SIGINT)
    assert process.wait() == 130
    assert process.stderr.read() == "structagent: interrupted\n"
