"""Print the text of the chat: titles, blocks, remarks, complaints."""

from __future__ import annotations

import textwrap

from rich.console import Console
from rich.text import Text

from agent.rendering.text import duration


class TextPrinter:
    """A printer of text on a console.

    Args:
        console: the console.
    """

    def __init__(self, console: Console) -> None:
        self._console = console

    def title(self, title: str, seconds: float | None = None) -> None:
        """Print an empty line and a title, with the duration of its step."""
        line = Text(title, "bold cyan")
        if seconds is not None:
            line.append(f" {duration(seconds)}", "not bold dim default")
        self._console.print()
        self._console.print(line, highlight=False)

    def block(self, text: str) -> None:
        """Print every line of the text with a small indent."""
        for line in text.splitlines():
            self.line(f"  {line}")

    def line(self, text: str, style: str = "") -> None:
        """Print a line; if it is wrapped, its continuation is indented a little further."""
        indent = " " * (len(text) - len(text.lstrip()) + 2)
        lines = textwrap.wrap(
            text, self._console.width, subsequent_indent=indent, drop_whitespace=True, break_on_hyphens=False
        )
        self._console.print(Text("\n".join(lines), style), highlight=False, soft_wrap=True)
