"""Define the slash commands of a conversation and their arguments."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from agent.chat.spoken_commands import spoken_command
from agent.errors import UsageError
from grounding.dialogue.acts import bare
from grounding.parse_result import shortened
from grounding.viewpoint import VIEWPOINTS

MOST_NUMBER = 10**9
_MOST_DIGITS = 25
PARSERS = ("embedding", "llm")
ARRANGEMENT = "NAME: X, Y, TURN; ..."


@dataclass(frozen=True)
class Command:
    """A slash command.

    Attributes:
        name: the name with its slash.
        takes: the arguments as the help shows them; empty for none.
        does: what the command does, in a few words.
        words: the legal arguments, if they can be listed.
    """

    name: str
    takes: str
    does: str
    words: tuple[str, ...] = ()


COMMANDS = (
    Command("/scene", "[new [SEED]]", "show the table from above, or set another one", ("new",)),
    Command("/objects", "", "list the objects and where they stand"),
    Command("/candidates", "[K]", "show the K best arrangements side by side"),
    Command("/choose", "K", "make arrangement K the one to build"),
    Command("/why", "", "explain why this arrangement was chosen and not the others"),
    Command("/plan", "", "show the arm's plan, its order and grasps, without moving anything"),
    Command("/go", "", "build the proposed arrangement"),
    Command("/again", "", "propose another arrangement, which differs visibly from those shown"),
    Command("/continue", "", "build the proposal, propose again what was interrupted, or go on after /wait"),
    Command("/stop", "", "drop the proposal or the question; while the arm builds, stop it"),
    Command("/wait", "", "while the arm builds: pause it with an empty hand, until /continue"),
    Command("/clear", "", "drop the goal; the table stays"),
    Command("/back", "[TURN]", "put every object back where it stood before the last build; or return to a turn"),
    Command("/timeline", "", "list the turns so far and their branches"),
    Command("/fork", "", "begin a branch with the next turn; the turns so far stay reachable with /back"),
    Command("/reset", "", "restore the table of the start and drop the goal"),
    Command("/undo", "", "restore the goal and the table as they were one turn ago"),
    Command("/redo", "", "revert an undo"),
    Command("/parser", "[NAME]", f"show or set the parser: {' or '.join(PARSERS)}", PARSERS),
    Command(
        "/viewpoint",
        "[SIDE]",
        f"show or set whose left and right the instructions use: {' or '.join(VIEWPOINTS)}",
        VIEWPOINTS,
    ),
    Command("/seed", "[N]", "show or set the random seed of proposals and plans"),
    Command("/save", "FILE", "write the present table to a scene file"),
    Command("/load", "FILE", "load a table from a scene file"),
    Command(
        "/example",
        "FILE [exact]",
        "set “the example” to what a file shows: a scene, a recording, a run, a chat, a figure",
    ),
    Command("/arrange", ARRANGEMENT, "set “the example” to objects at these places (metres, degrees)"),
    Command("/report", "[FILE]", "write the conversation so far as an HTML page"),
    Command("/help", "", "list the commands"),
    Command("/quit", "", "end the chat, as Ctrl-D does"),
)
_WHERE_IT_WAS = re.compile(
    r" (?:to )?(?:(?:where|how|the way|as|like) (?:it|they|that|this|everything|things|all) (?:was|were|stood|had been"
    r"|came from|used to be|belongs?)(?: before| at first| in the beginning)?|before|like before|as before|again)$"
)
_REQUEST = re.compile(
    r"^(?:(?:no|nope|oops|whoops|oh no|damn|argh) )*(?:(?:can|could|would|will) (?:you|we) |let us |let's |i want to "
    r"|i would like to |i'd like to |you can |you should )?(?:please )?(?:just )?"
)
# "put the cups back" may mean the back of the table; an instruction cannot name the place where they stood before.
_BACK_WHERE_IT_WAS = re.compile(r"(?:put|move|bring) (?P<these>the [\w' ]+?) back(?P<where> .+)")


_BACK_TO_TURN = re.compile(r"(?:(?:go|return|take me) )?back to (?:turn|step) (?P<number>\d+)")


def _spoken(line: str) -> str | None:
    """Return the command that a line expresses in words; `None` if the line says anything else as well.

    Raises:
        UsageError: if only some of the objects should be put back.
    """
    said = " ".join(bare(line).replace(",", " ").split()) or line.strip()
    if turn := _BACK_TO_TURN.fullmatch(said):
        return f"/back {turn['number']}"
    for shorter in (said, _REQUEST.sub("", said)):
        for wording in (shorter, _WHERE_IT_WAS.sub("", shorter)):
            name = spoken_command(wording)
            if name is not None and (wording == shorter or name == "/back"):
                return name
        found = _BACK_WHERE_IT_WAS.fullmatch(shorter)
        if found and _WHERE_IT_WAS.fullmatch(found["where"]):
            these = shortened(found["these"])
            raise UsageError(
                f"{these} cannot be put back alone; “put it back” restores everything that the last build moved"
            )
    return None


def command_of(line: str) -> tuple[Command, str] | None:
    """Parse a line as a command and its argument. Return `None` if the line is an instruction.

    Raises:
        UsageError: for an unknown command, a superfluous argument and a missing one.
    """
    line = line.strip()
    if line.startswith("/"):  # "/start over", "/never mind"
        known = line.partition(" ")[0].lower() in [command.name for command in COMMANDS]
        line = line if known else spoken_command(bare(line[1:])) or line
    else:
        line = _spoken(line) or line
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
        raise UsageError(f"{name} takes no argument, got {rest!r}")
    if not rest and command.takes and not command.takes.startswith("["):
        raise UsageError(f"{name} needs {command.takes}: {name} {command.takes}")
    return command, rest


def whole_number(command: str, text: str, least: int, most: int = MOST_NUMBER) -> int:
    """Parse the number after a command.

    Raises:
        UsageError: if it is not a whole number from `least` to `most`.
    """
    if not text.isdecimal() or len(text) > _MOST_DIGITS or not least <= int(text) <= most:
        legal = f"from {least} on" if most == MOST_NUMBER else f"from {least} to {most}"
        raise UsageError(f"{command} takes a whole number {legal}, got {shortened(text)!r}")
    return int(text)


def one_of(command: str, text: str, legal: Sequence[str]) -> str:
    """Return the word after a command if it is legal.

    Raises:
        UsageError: if it is not one of the legal words.
    """
    if text not in legal:
        raise UsageError(f"{command} takes {' or '.join(legal)}, got {text!r}")
    return text


def help_lines() -> list[tuple[str, str]]:
    """Return (name and arguments, what it does) of every command."""
    return [(f"{command.name} {command.takes}".strip(), command.does) for command in COMMANDS]
