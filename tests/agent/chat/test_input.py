"""Lines from a file and completions; the prompt itself is tried in a real terminal, with the chat."""

import io

import pytest

from agent.chat.input import PlainLines, completions, history_file
from agent.runtime.stdio import LONGEST_LINE

COMMANDS = {"/parser": ("embedding", "llm"), "/plan": (), "/help": ()}


def texts(text: str) -> list[str]:
    return [completion.text for completion in completions(text, COMMANDS, ("circle", "cups", "left"))]


@pytest.mark.parametrize(
    ("text", "offered"),
    [
        ("/", ["/parser", "/plan", "/help"]),
        ("/p", ["/parser", "/plan"]),
        ("/parser ", ["embedding", "llm"]),
        ("/parser l", ["llm"]),
        ("/parser llm ", []),
        ("/plan ", []),
        ("put the c", ["circle", "cups"]),
        ("put the cups", []),
        ("put the ", []),
        ("", []),
    ],
)
def test_completions(text, offered):
    assert texts(text) == offered


def test_a_completion_takes_the_place_of_what_was_begun():
    (completion,) = completions("in a ci", COMMANDS, ("circle",))
    assert completion.start_position == -2


def test_piped_lines_are_shown_behind_their_prompts():
    shown = []
    lines = PlainLines(io.StringIO("a \x1b[31mcircle\r\ny"), shown.append)
    assert [lines.ask("> "), lines.ask("build it? "), lines.ask("> ")] == ["a  [31mcircle", "y", None]
    assert shown == ["> a  [31mcircle\n", "build it? y\n"]


def test_a_terminal_without_cursor_control_gets_its_prompt_first():
    shown = []
    lines = PlainLines(io.StringIO("a circle\n"), shown.append, typed=True)
    assert lines.ask("> ") == "a circle"
    assert shown == ["> "]


def test_history_has_a_place(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert history_file() == tmp_path / "structagent" / "history"
    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert history_file() == tmp_path / ".local" / "state" / "structagent" / "history"


@pytest.mark.parametrize("longer", [0, 1, LONGEST_LINE - 1, LONGEST_LINE, 3 * LONGEST_LINE + 7])
def test_of_a_line_without_measure_the_beginning_is_kept_and_the_next_one_is_whole(longer):
    shown: list[str] = []
    lines = PlainLines(io.StringIO("a" * (LONGEST_LINE + longer) + "\nmake a line\n"), shown.append)
    assert lines.ask("> ") == "a" * LONGEST_LINE
    assert lines.ask("> ") == "make a line"
    assert lines.ask("> ") is None
    assert sum(map(len, shown)) < LONGEST_LINE + 100
