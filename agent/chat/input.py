"""Read a conversation's lines: from a prompt with history and completion on a terminal, otherwise from standard
input.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TextIO

from agent.chat.interjections import Interjection, Script, Source, Typed
from agent.runtime.output_paths import state_folder
from agent.runtime.stdio import LONGEST_LINE

if TYPE_CHECKING:
    from prompt_toolkit.completion import CompleteEvent, Completion
    from prompt_toolkit.document import Document

# Command -> its words, and the words that instructions are made of.
Words = Callable[[], Sequence[str]]


class Lines(Protocol):
    """A source of lines.

    Attributes:
        typed: whether a user types the lines.
    """

    typed: bool

    def ask(self, prompt: str) -> str | None:
        """Return the next line, or `None` after the last one.

        Raises:
            KeyboardInterrupt: on Ctrl-C.
        """

    def while_building(self) -> Source:
        """Return who says something while the arm builds, from now until the next line is asked for."""


class PlainLines:
    """The lines of a file or of a terminal without cursor control.

    Args:
        file: the stream to read from.
        show: writes text without a line break.
        typed: whether a user types at a terminal, which echoes the text. Otherwise each line is printed after its
            prompt, so that the output reads as a conversation.
    """

    def __init__(self, file: TextIO, show: Callable[[str], object], typed: bool = False) -> None:
        self._file, self._show, self.typed = file, show, typed
        self._ahead: list[str] = []  # lines that were read before they were asked for
        self._script = Script([])

    def ask(self, prompt: str) -> str | None:
        """Return the next line, as `Lines.ask` does."""
        if self.typed:
            self._show(prompt)
        self._ahead = self._script.rest() + self._ahead
        line = self._ahead.pop(0) if self._ahead else self._read()
        if line is not None and not self.typed:
            self._show(f"{prompt}{line}\n")
        return line

    def while_building(self) -> Source:
        """Return who types while the arm builds, or the lines that follow with a number of placements: "@2 ..."."""
        if self.typed:
            return Typed(self._file)
        script = list[Interjection]()
        while (line := self._ahead.pop(0) if self._ahead else self._read()) is not None:
            if (one := Interjection.parse(line)) is None:
                self._ahead.insert(0, line)
                break
            script.append(one)
        self._script = Script(script, lambda line: self._show(f"> {line}\n"))
        return self._script

    def _read(self) -> str | None:
        line = self._file.readline(LONGEST_LINE)
        if not line:
            return None
        rest = line
        while len(rest) == LONGEST_LINE and not rest.endswith("\n"):  # of a longer line the beginning is kept
            rest = self._file.readline(LONGEST_LINE)
        return "".join(char if char.isprintable() else " " for char in line.rstrip("\r\n"))


class PromptedLines:
    """A prompt: arrows go through the history, Tab completes, Alt-Enter begins another line, Ctrl-D ends.

    Args:
        commands: slash command -> its legal arguments.
        words: returns the words to complete in instructions; called each time.
    """

    typed = True

    def __init__(self, commands: Mapping[str, Sequence[str]], words: Words) -> None:
        from prompt_toolkit import PromptSession
        from prompt_toolkit.auto_suggest import AutoSuggestFromHistory
        from prompt_toolkit.completion import Completer
        from prompt_toolkit.key_binding import KeyBindings

        class _Completing(Completer):
            def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterable[Completion]:
                return completions(document.text_before_cursor, commands, words())

        keys = KeyBindings()

        @keys.add("enter")
        def _(event) -> None:
            event.current_buffer.validate_and_handle()

        @keys.add("escape", "enter")
        def _(event) -> None:
            event.current_buffer.insert_text("\n")

        self._session: PromptSession[str] = PromptSession(
            history=_history(),
            completer=_Completing(),
            complete_while_typing=False,
            auto_suggest=AutoSuggestFromHistory(),
            key_bindings=keys,
            multiline=True,
            prompt_continuation=lambda width, number, wrapped: " " * width,
        )

    def ask(self, prompt: str) -> str | None:
        """Return the next line, as `Lines.ask` does."""
        try:
            return self._session.prompt(prompt)
        except EOFError:
            return None

    def while_building(self) -> Source:
        """Return who types while the arm builds; between two prompts the terminal gives whole lines."""
        return Typed(sys.stdin)


def completions(text: str, commands: Mapping[str, Sequence[str]], words: Sequence[str]) -> Iterator[Completion]:
    """Yield the completions at the cursor.

    Args:
        text: the text before the cursor.
        commands: slash command -> its legal arguments.
        words: the words to complete in instructions.
    """
    from prompt_toolkit.completion import Completion

    head, space, rest = text.partition(" ")
    begun = text.rsplit(" ", 1)[-1]
    if text.startswith("/") and not space:
        offered: Sequence[str] = list(commands)
    elif text.startswith("/"):
        offered = commands.get(head, ()) if " " not in rest else ()
    else:
        offered = words if begun else ()
    for word in offered:
        if word.startswith(begun) and word != begun:
            yield Completion(word, start_position=-len(begun))


def _history():
    from prompt_toolkit.history import FileHistory, InMemoryHistory

    path = history_file()
    if path is None:
        return InMemoryHistory()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch(mode=0o600)
    except OSError:  # a home that cannot be written to is no reason not to talk
        return InMemoryHistory()
    return FileHistory(str(path))


def history_file() -> Path | None:
    """Return the path of the line history in the folder for state; `None` without a home folder."""
    folder = state_folder()
    return None if folder is None else folder / "history"
