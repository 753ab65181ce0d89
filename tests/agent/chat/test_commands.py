"""Slash commands are found, completed where they are clear, and refused in one sentence."""

import pytest

from agent.chat.commands import COMMANDS, command_of, help_lines, one_of, whole_number
from agent.chat.input import completions
from agent.errors import UsageError


@pytest.mark.parametrize("line", ["put the cups in a circle", "a / b", "undo the circle and make a line", "no"])
def test_instructions_are_no_commands(line):
    assert command_of(line) is None


@pytest.mark.parametrize(
    ("line", "name", "rest"),
    [
        ("/undo", "/undo", ""),
        ("  /choose   3 ", "/choose", "3"),
        ("/cand", "/candidates", ""),
        ("/save my desk.yaml", "/save", "my desk.yaml"),
        ("undo", "/undo", ""),
        ("Undo!", "/undo", ""),
        ("quit", "/quit", ""),
    ],
)
def test_commands(line, name, rest):
    command, what = command_of(line)
    assert (command.name, what) == (name, rest)


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("/xyzzy", "there is no /xyzzy; see /help"),
        ("/chose 3", "there is no /chose; did you mean /choose?"),
        ("/re", "there is no /re; did you mean /reset or /redo or /report?"),
        ("/", "there is no /"),
        ("/undo 3", "/undo takes no argument, got '3'"),
        ("/save", "/save needs FILE"),
    ],
)
def test_what_is_wrong_is_said(line, sentence):
    with pytest.raises(UsageError) as error:
        command_of(line)
    assert str(error.value).startswith(sentence)


def test_values():
    assert whole_number("/seed", "12", 0) == 12
    for wrong in ("", "-1", "x", "1.5", "０x"):
        with pytest.raises(UsageError, match="/choose takes a whole number from 1 on"):
            whole_number("/choose", wrong, 1)
    with pytest.raises(UsageError, match="/parser takes embedding or llm, got 'gpt'"):
        one_of("/parser", "gpt", ("embedding", "llm"))


def test_help_lists_every_command():
    help_texts = dict(help_lines())
    assert len(help_texts) == len(COMMANDS) and all(help_texts.values())


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("stop", "/stop"),
        ("Stop it!", "/stop"),
        ("no, stop please", "/stop"),
        ("cancel that", "/stop"),
        ("clear", "/clear"),
        ("forget it", "/clear"),
        ("ok forget about it", "/clear"),
        ("start over", "/reset"),
        ("let's start over", "/reset"),
        ("Reset, please.", "/reset"),
        ("continue", "/continue"),
        ("go on", "/continue"),
        ("please carry on", "/continue"),
        ("can you continue?", "/continue"),
        ("put it back", "/back"),
        ("put everything back", "/back"),
        ("could you put everything back where it was", "/back"),
        ("put them back the way they were", "/back"),
        ("help me", "/help"),
        ("?", "/help"),
    ],
)
def test_commands_in_words(line, name):
    command, rest = command_of(line)
    assert (command.name, rest) == (name, "") and command.name in {line.split()[0] for line, _ in help_lines()}


@pytest.mark.parametrize(
    "line",
    [
        "stop the tower", "clear the left side", "put it back on the left", "continue the line",
        "go on and stack the cans", "put it at the back", "put the cups back", "start over there on the left",
        "start with the cups", "forget the size", "put everything back on the right", "cancel the rotation",
        "reset the position", "stop, put them in a line", "put it back in a line", "go on the left",
        "keep going to the left", "undo and make a line", "help me to build a tower", "no, bigger", "again but smaller",
    ],
)  # fmt: skip
def test_what_only_begins_like_a_command_is_an_instruction(line):
    assert command_of(line) is None


def test_some_of_the_objects_cannot_be_put_back():
    for line in ("put the cups back where they were", "can you put the red cup back to where it was before?"):
        with pytest.raises(UsageError, match="cup.* cannot be put back alone; “put it back” restores everything"):
            command_of(line)


def test_tab_completes_them():
    offered = {command.name: command.words for command in COMMANDS}
    for begun, name in (
        ("/con", "/continue"),
        ("/st", "/stop"),
        ("/cl", "/clear"),
        ("/ba", "/back"),
        ("/res", "/reset"),
    ):
        assert [each.text for each in completions(begun, offered, ())] == [name]
