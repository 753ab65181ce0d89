"""The lines of the driver: one for each time that the chat asks, and none that ends or harms what it should not."""

import os
import signal
import threading
import time
from types import SimpleNamespace

import pytest

from agent.chat.interjections import Moment
from agent.live_view.driver_lines import LONGEST, MOST_WAITING, DriverLines
from grounding.parse_result import Question


class Page:
    """A server without pages that keeps what it would tell them."""

    def __init__(self) -> None:
        self.told = []

    def publish(self, kind, payload):
        self.told.append((kind, payload))


@pytest.fixture
def page() -> Page:
    return Page()


@pytest.fixture
def lines(page) -> DriverLines:
    lines = DriverLines(files=True)
    lines.show_on(page, lambda line: page.told.append(("said", line)))
    return lines


def asking(lines, answer: list) -> threading.Thread:
    """A thread in which the chat asks; waits until it does."""
    thread = threading.Thread(target=lambda: answer.append(lines.ask("> ")), daemon=True)
    thread.start()
    end = time.monotonic() + 10
    while lines.actions["line"]({"line": ""}) and not lines._asking:
        assert time.monotonic() < end
        time.sleep(0.01)
    return thread


def test_a_line_answers_what_is_asked_and_the_next_has_to_wait(lines, page):
    answer = []
    assert lines.actions["line"]({"line": "too early"}) == "the agent is at work; wait, or stop it"
    thread = asking(lines, answer)
    assert lines.actions["line"]({"line": "put the cups in a circle"}) == ""
    assert lines.actions["line"]({"line": "and a second one"}) == "the agent is at work; wait, or stop it"
    thread.join(10)
    assert answer == ["put the cups in a circle"]
    assert page.told.pop() == ("said", "put the cups in a circle")
    assert [payload["prompt"] for _, payload in page.told] == ["> ", ""]


def test_control_characters_become_spaces(lines):
    answer = []
    thread = asking(lines, answer)
    assert lines.actions["line"]({"line": "stack\x1b[2J the\ncans\u202e"}) == ""
    thread.join(10)
    assert answer == ["stack [2J the cans "]


@pytest.mark.parametrize("line", [None, 7, "", "  ", ["x"], {"a": 1}])
def test_what_is_no_line_is_refused(lines, line):
    assert lines.actions["line"]({"line": line}) == "the line is empty"
    assert lines.actions["line"]({}) == "the line is empty"


def test_a_line_that_is_too_long_is_refused(lines):
    assert (
        lines.actions["line"]({"line": "x" * (LONGEST + 1)})
        == f"a line has at most {LONGEST} characters, but this one has {LONGEST + 1}"
    )


@pytest.mark.parametrize("line", ["/quit", " /QUIT", "/qui", "quit", "bye"])
def test_a_page_cannot_end_the_chat(lines, line):
    if lines.actions["line"]({"line": line}) == "the agent is at work; wait, or stop it":
        pytest.skip(f"{line!r} is not said to end a chat")
    assert "Ctrl-C in the terminal" in lines.actions["line"]({"line": line})


@pytest.mark.parametrize(
    "line",
    [
        "/save desk.yaml",
        "/load /etc/passwd",
        "/example /etc/passwd",
        "/report page.html",
        "/SAVE x.yaml",
        "/sav x.yaml",
    ],
)
def test_files_are_for_pages_of_this_machine(line):
    assert "works only for pages on the machine" in DriverLines(files=False).actions["line"]({"line": line})
    assert "at work" in DriverLines(files=True).actions["line"]({"line": line})


def test_the_report_of_the_session_needs_no_file():
    assert "at work" in DriverLines(files=False).actions["line"]({"line": "/report"})


def test_nothing_is_stopped_before_the_chat_began_and_while_it_asks(lines):
    assert lines.actions["stop"]({}) == "nothing is at work"
    thread = asking(lines, [])
    assert lines.actions["stop"]({}) == "nothing is at work"
    lines.actions["line"]({"line": "x"})
    thread.join(10)


def test_stopping_interrupts_the_main_thread_once(lines, page):
    thread = asking(lines, [])
    lines.actions["line"]({"line": "build"})
    thread.join(10)
    presses = []
    presser = threading.Timer(0.2, lambda: presses.extend(lines.actions["stop"]({}) for _ in range(3)))
    presser.start()
    with pytest.raises(KeyboardInterrupt):
        time.sleep(10)
    presser.join(10)
    assert presses == ["", "it is stopping", "it is stopping"]
    assert page.told.pop() == (
        "asking",
        {"prompt": "", "choices": [], "choosing": False, "stopping": True, "listening": False},
    )


def test_ctrl_c_in_the_terminal_ends_the_chat_while_it_asks(lines):
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    assert lines.ask("> ") is None


class Talk:
    """What the buttons follow from, of a conversation."""

    def __init__(self, question=None, rank=0, can_undo=False, asked=False, built=False) -> None:
        proposal = SimpleNamespace(rank=rank) if rank else None
        self.question, self.can_undo, self.table, self.examples = question, can_undo, object(), 0
        self.situation = SimpleNamespace(proposal=proposal, asked=asked, built=built)

    def example(self):
        self.examples += 1
        return SimpleNamespace(text="put the cups in a line")


@pytest.mark.parametrize(
    ("talk", "buttons"),
    [
        (Talk(), [("put the cups in a line", "put the cups in a line")]),
        (Talk(rank=3, asked=True, can_undo=True), [("Build arrangement 3", "yes"), ("Show others", "/again"),
                                                   ("No", "no")]),
        (Talk(Question("shape", "Which?", ("circle", "line")), 3, True, True),
         [("circle", "1"), ("line", "2"), ("Drop the question", "/stop")]),
        (Talk(can_undo=True, asked=True, built=True), [("Undo", "/undo")]),
        (Talk(can_undo=True, asked=True), [("Show others", "/again"), ("Undo", "/undo")]),
    ],
)  # fmt: skip
def test_the_buttons_are_what_can_be_answered(lines, talk, buttons):
    lines.answer_for(talk)
    for _ in range(2):
        assert [(one["label"], one["line"]) for one in lines._choices()] == buttons
    assert talk.examples <= 1, "the same table is not looked at for each line"


def test_control_characters_in_an_option_are_visible(lines):
    lines.answer_for(Talk(Question("object", "Which?", ("cup \u202e1",))))
    assert lines._choices()[0]["label"] == r"cup \u202e1"


def test_while_the_arm_builds_every_line_is_taken(lines, page):
    lines.answer_for(talk := SimpleNamespace(question=None, situation=SimpleNamespace(proposal=None)))
    source = lines.while_building()
    assert page.told[-1][1]["listening"] and not page.told[-1][1]["prompt"]
    assert lines.actions["line"]({"line": "wait"}) == lines.actions["line"]({"line": "on the left"}) == ""
    assert [source.next(Moment()) for _ in range(3)] == ["wait", "on the left", None] and not source.silent
    assert page.told[-1] == ("said", "on the left")
    talk.question = Question("goal", "which of these is meant?", ("a line", "a circle"))
    assert source.next(Moment()) is None
    assert [one["line"] for one in page.told[-1][1]["choices"]] == ["1", "2", "no"]
    assert source.next(Moment()) is None and len([kind for kind, _ in page.told if kind == "asking"]) == 2


def test_a_line_that_came_too_late_for_the_build_answers_the_next_prompt(lines, page):
    lines.while_building()
    assert lines.actions["line"]({"line": "bigger"}) == "" and lines.ask("> ") == "bigger"
    assert (
        not page.told[0][1]["prompt"]
        and lines.actions["line"]({"line": "more"}) == "the agent is at work; wait, or stop it"
    )


def test_lines_that_nobody_reads_are_not_piled_up(lines, page):
    lines.while_building()
    assert {lines.actions["line"]({"line": "wait"}) for _ in range(MOST_WAITING)} == {""}
    assert lines.actions["line"]({"line": "wait"}) == "16 lines wait to be read; try again later"
