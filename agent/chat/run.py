"""Run a whole chat: set it up, load models while the user types, keep the session, and close the table."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import IO, TYPE_CHECKING, Protocol, TextIO

from rich.console import Console
from rich.markup import escape

from agent.chat.commands import COMMANDS
from agent.chat.conversation import Conversation
from agent.chat.file_access import FileAccess
from agent.chat.input import Lines, PlainLines, PromptedLines
from agent.chat.interrupts import exit_on_repeated_interrupts
from agent.chat.preloading import Preloading
from agent.chat.repl import Chat
from agent.chat.view import ChatScreen
from agent.event_base import Listener, json_value
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from agent.reporting.session_log import SessionWriter
from agent.reporting.turn_records import TurnRecords
from agent.runtime.memory import give_back
from agent.runtime.output_ownership import OwnFolder
from grounding.spec import LEGAL_VALUES

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene


class Viewer(Listener, Protocol):
    """A listener that shows the table too, in three dimensions."""

    def on_physics_step(self, table: TableScene) -> None:
        """Take the table after a physics step while the arm is at work."""

    def on_waiting(self, conversation: Conversation) -> None:
        """Take the conversation before each line that is asked for; the table is at rest."""


def run_chat(
    options: RunOptions, console: Console, session: Path, lines: TextIO, yes: bool, viewer: Viewer | None = None
) -> int:
    """Run a chat in the terminal, or with the lines of a file, until its lines end.

    Args:
        options: the options of a run.
        console: the console to show the chat on.
        session: the session file; an existing one is continued.
        lines: the stream of lines; if it is a terminal, `console` must be one too, and a prompt is shown.
        yes: whether to build without asking.
        viewer: shows the table elsewhere too.

    Returns: as `converse`.
    """
    with _without_control_echo(lines):
        return converse(
            options, ChatScreen(console), session, lambda talk: _lines(lines, console, talk), yes, console.file, viewer
        )


def converse(
    options: RunOptions,
    screen: ChatScreen,
    session: Path,
    source: Callable[[Conversation], Lines],
    yes: bool,
    terminal: IO[str],
    viewer: Viewer | None = None,
    access: FileAccess = FileAccess(),
) -> int:
    """Run a chat on any screen until its lines end.

    Args:
        options: the options of a run.
        screen: the screen to show the chat on.
        session: the session file; an existing one is continued.
        source: makes the source of the lines of the conversation.
        yes: whether to build without asking.
        terminal: the stream that is told when repeated Ctrl-C ends the process.
        viewer: shows the table.
        access: which files its commands may name.

    Returns:
        The exit code: 0, or that of the worst error, a file that could not be written or a defect of the program. Each
        error was shown when it happened, and the chat continued.
    """
    cache = ResourceCache(OwnFolder(session.parent, "chat"))
    viewers = () if viewer is None else (viewer,)
    with SessionWriter(session, json_value(asdict(options)), owner="chat") as writer:
        with Conversation(options, cache, [screen, TurnRecords(writer), *viewers]) as conversation:
            preloading = Preloading(cache, options)
            with exit_on_repeated_interrupts(terminal) as stopped:

                def waiting() -> None:
                    stopped()
                    give_back()
                    if viewer is not None:
                        viewer.on_waiting(conversation)

                try:
                    on_step = None if viewer is None else viewer.on_physics_step
                    chat = Chat(conversation, screen, source(conversation), session, yes, waiting, on_step, access)
                    chat.run(preloading.start)  # not sooner: it would slow down what the user waits for
                finally:
                    preloading.join()
    return chat.exit_code


@contextmanager
def _without_control_echo(lines: TextIO) -> Iterator[None]:
    """Keep the terminal from echoing ^C into a map that is being drawn."""
    if not lines.isatty():
        yield
        return
    import termios

    before = termios.tcgetattr(lines)
    quiet = list(before)
    quiet[3] &= ~termios.ECHOCTL
    termios.tcsetattr(lines, termios.TCSANOW, quiet)
    try:
        yield
    finally:
        termios.tcsetattr(lines, termios.TCSANOW, before)


def _lines(lines: TextIO, console: Console, conversation: Conversation) -> Lines:
    if lines.isatty() and console.is_terminal and not console.is_dumb_terminal:
        commands = {command.name: command.words for command in COMMANDS}
        return PromptedLines(commands, lambda: _vocabulary(conversation))

    def show(text: str) -> None:
        console.print(escape(text), highlight=False, soft_wrap=True, end="")
        console.file.flush()

    return PlainLines(lines, show, typed=lines.isatty())


def _vocabulary(conversation: Conversation) -> Sequence[str]:
    """Return the words that Tab completes: values of slots and nouns of the objects on the table."""
    values = [value for slot in LEGAL_VALUES.values() for value in slot]
    nouns = {model.category for model in conversation.table.models}
    return sorted({*values, *nouns, *(f"{noun}s" for noun in nouns)})
