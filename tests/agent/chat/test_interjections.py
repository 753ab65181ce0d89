"""Lines are said at moments of a build: as they are typed, or after a number of placements, whatever the clock says."""

import io
import os
import pty

import pytest

from agent.chat.commands import command_of
from agent.chat.input import PlainLines
from agent.chat.interjections import Interjection, Moment, Queued, Script, Typed


@pytest.mark.parametrize(
    "text, expected",
    [
        ("@2 on the left instead", Interjection("on the left instead", 2)),
        (" @0  stop ", Interjection("stop", 0)),
        ("@1+ no, the red one first", Interjection("no, the red one first", 1, True)),
        ("@ 2 stop", None),
        ("@2", None),
        ("2 stop", None),
        ("put the cups @2 cm apart", None),
    ],
)
def test_a_line_with_a_mark_is_said_after_a_number_of_placements(text, expected):
    assert Interjection.parse(text) == expected


def test_an_interjection_is_due_once_the_build_has_come_so_far():
    after, in_hand = Interjection("stop", 1), Interjection("stop", 1, True)
    moments = [Moment(0, True), Moment(1), Moment(1, True), Moment(2), Moment(0, waiting=True)]
    assert [after.is_due(one) for one in moments] == [False, True, True, True, True]
    assert [in_hand.is_due(one) for one in moments] == [False, False, True, True, True]


def test_a_script_keeps_its_order_and_what_was_not_said():
    said = []
    script = Script([Interjection("second", 2), Interjection("first", 1), Interjection("last", 9)], said.append)
    assert script.next(Moment(1)) is None
    assert [script.next(Moment(2)) for _ in range(3)] == ["second", "first", None] and said == ["second", "first"]
    assert not script.silent and script.rest() == ["last"] and script.silent


def test_what_is_typed_is_there_at_once_and_nobody_waits_for_it():
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "r", encoding="utf-8") as terminal:
        typed = Typed(terminal)
        assert typed.next(Moment()) is None
        os.write(ours, b"make it a line\nsto")
        assert typed.next(Moment()).strip() == "make it a line" and typed.next(Moment()) is None
        os.write(ours, b"p\n")
        assert typed.next(Moment()).strip() == "stop"
        os.close(ours)


def test_lines_of_other_threads_come_in_their_order():
    queued = Queued()
    queued.put("first")
    queued.put("second")
    assert [queued.next(Moment()) for _ in range(3)] == ["first", "second", None]


def test_a_pipe_hands_over_the_marked_lines_that_follow():
    shown = []
    lines = PlainLines(io.StringIO("put the cups in a line\n@1 stop\n@2 go on\nundo\n@1 late\n"), shown.append)
    assert lines.ask("> ") == "put the cups in a line"
    script = lines.while_building()
    assert script.next(Moment(1)) == "stop" and shown[-1] == "> stop\n"
    assert [lines.ask("> ") for _ in range(4)] == ["go on", "undo", "@1 late", None]


@pytest.mark.parametrize(
    "line", ["wait", "wait a moment", "please wait", "pause", "Wait!", "hang on a second", "one moment please"]
)
def test_waiting_is_a_command_in_words(line):
    assert command_of(line)[0].name == "/wait"


@pytest.mark.parametrize(
    "line", ["wait, a circle", "wait, put it on the left", "a second", "pause the cups", "wait for the cup"]
)
def test_what_says_more_is_no_command(line):
    assert command_of(line) is None
