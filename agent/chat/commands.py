"""The slash commands of a conversation: what they are called, and what they take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from agent.errors import UsageError
from grounding.parse import shortened
from grounding.reading import VIEWPOINTS

MOST_NUMBER = 10**9
_MOST_DIGITS = 25
PARSERS = ("embedding", "llm")


@dataclass(frozen=True)
class Command:
    """A slash command.

    Attributes:
        name: with its slash.
        takes: what may follow, for the help; empty where nothing may.
        does: in a few words.
        words: the values that may follow, where they are known.
    """

    name: str
    takes: str
    does: str
    words: tuple[str, ...] = ()


COMMANDS = (
    Command("/scene", "[new [SEED]]", "show the table from above, or set another one", ("new",)),
    Command("/objects", "", "what stands where"),
    Command("/candidates", "[K]", "the K best arrangements side by side"),
    Command("/choose", "K", "make arrangement K the one to build"),
    Command("/why", "", "what speaks for it, and against the others"),
    Command("/plan", "", "in which order the arm would build it, and with which grasps; nothing moves"),
    Command("/go", "", "build it"),
    Command("/again", "", "imagine anew, from the next seed"),
    Command("/undo", "", "the wish and the table as they were before"),
    Command("/redo", "", "take an undo back"),
    Command("/parser", "[NAME]", f"who reads: {' or '.join(PARSERS)}", PARSERS),
    Command("/viewpoint", "[SIDE]", f"whose left and right is meant: {' or '.join(VIEWPOINTS)}", VIEWPOINTS),
    Command("/seed", "[N]", "what is drawn at random follows from it"),
    Command("/save", "FILE", "the table as it stands, as a scene file"),
    Command("/load", "FILE", "a table from a scene file"),
    Command("/report", "[FILE]", "the conversation so far as a page"),
    Command("/help", "", "this"),
    Command("/quit", "", "end; so does Ctrl-D"),
)
# What people say instead.
SPOKEN = {
    "undo": "/undo",
    "undo that": "/undo",
    "take that back": "/undo",
    "redo": "/redo",
    "again": "/again",
    "try again": "/again",
    "help": "/help",
    "?": "/help",
    "quit": "/quit",
    "exit": "/quit",
    "bye": "/quit",
    "goodbye": "/quit",
}


def command_of(line: str) -> tuple[Command, str] | None:
    """The command that a line is, and what follows it; `None` where it is an instruction.

    Raises:
        UsageError: when there is no such command, and for a value where none may follow, or none where one must.
    """
    line = SPOKEN.get(line.strip().rstrip(".!").lower(), line.strip())
    if not line.startswith("/"):
        return None
    name, _, rest = line.partition(" ")
    name, rest = name.lower(), rest.strip()
    names = [command.name for command in COMMANDS]
    if name not in names:
        begun = [each for each in names if each.startswith(name)]
        if len(begun) != 1 or len(name) < 2:
            close = begun[:3] or get_close_matches(name, names, 1)
            name = shortened(name)
            hint = f"did you mean {' or '.join(close)}?" if close else "see /help"
            raise UsageError(f"there is no {name}; {hint}")
        name = begun[0]
    command = COMMANDS[names.index(name)]
    if rest and not command.takes:
        raise UsageError(f"{name} takes nothing, got {rest!r}")
    if not rest and command.takes and not command.takes.startswith("["):
        raise UsageError(f"{name} needs {command.takes}: {name} {command.takes}")
    return command, rest


def whole_number(command: str, text: str, least: int, most: int = MOST_NUMBER) -> int:
    """The number that follows a command.

    Raises:
        UsageError: when it is none, or not from `least` to `most`.
    """
    if not text.isdecimal() or len(text) > _MOST_DIGITS or not least <= int(text) <= most:
        legal = f"from {least} on" if most == MOST_NUMBER else f"from {least} to {most}"
        raise UsageError(f"{command} takes a whole number {legal}, got {shortened(text)!r}")
    return int(text)


def one_of(command: str, text: str, legal: Sequence[str]) -> str:
    """The word that follows a command.

    Raises:
        UsageError: when it is none of the legal ones.
    """
    if text not in legal:
        raise UsageError(f"{command} takes {' or '.join(legal)}, got {text!r}")
    return text


def help_lines() -> list[tuple[str, str]]:
    """(command with what it takes, what it does), one each."""
    return [(f"{command.name} {command.takes}".strip(), command.does) for command in COMMANDS]
