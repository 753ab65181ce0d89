"""Print the text of the chat: titles, tables, remarks, complaints, questions, checks."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Protocol

from rich.console import Console
from rich.text import Text

from agent.rendering.text import aligned, duration


class Printer(Protocol):
    """A display of what is said in a chat, piece by piece; its methods are those of `TextPrinter`."""

    def said(self, line: str) -> None: ...

    def title(self, title: str, seconds: float | None = None) -> None: ...

    def rows(self, rows: Sequence[Sequence[str]]) -> None: ...

    def line(self, text: str, style: str = "") -> None: ...

    def answer(self, text: str) -> None: ...

    def question(self, question: str, options: Sequence[str]) -> None: ...

    def check(self, passed: bool, sentence: str) -> None: ...

    def space(self) -> None: ...


class TextPrinter:
    """A printer of text on a console.

    Args:
        console: the console.
    """

    def __init__(self, console: Console) -> None:
        self._console = console

    def said(self, line: str) -> None:
        """Print a line of the user."""
        self.space()
        self.line(f"> {line}", "bold")

    def title(self, title: str, seconds: float | None = None) -> None:
        """Print an empty line and a title, with the duration of its step."""
        line = Text(title, "bold cyan")
        if seconds is not None:
            line.append(f" {duration(seconds)}", "not bold dim default")
        self.space()
        self._console.print(line, highlight=False)

    def rows(self, rows: Sequence[Sequence[str]]) -> None:
        """Print a table with a small indent, its columns aligned."""
        for line in aligned(rows).splitlines() if rows else ():
            self.line(f"  {line}")

    def line(self, text: str, style: str = "") -> None:
        """Print a line; if it is wrapped, its continuation is indented a little further."""
        indent = " " * (len(text) - len(text.lstrip()) + 2)
        lines = textwrap.wrap(
            text, self._console.width, subsequent_indent=indent, drop_whitespace=True, break_on_hyphens=False
        )
        self._console.print(Text("\n".join(lines), style), highlight=False, soft_wrap=True)

    def answer(self, text: str) -> None:
        """Print the lines of an answer; those with columns are aligned already."""
        for line in text.splitlines():
            self.line(line)

    def question(self, question: str, options: Sequence[str]) -> None:
        """Print a question with its numbered options; its lines before the last show what it is about."""
        *shown, said = question.splitlines()
        for line in shown:
            self.line(line)
        self.line(said, "bold")
        for number, option in enumerate(options, start=1):
            self.line(f"  {number}  {option}")

    def check(self, passed: bool, sentence: str) -> None:
        """Print a check that passed or failed."""
        self.line(f"  {'passed' if passed else 'failed'}  {sentence}", "" if passed else "red")

    def space(self) -> None:
        """Print an empty line."""
        self._console.print()
