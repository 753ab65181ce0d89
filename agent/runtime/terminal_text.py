"""What reaches the terminal: text without control characters, so that nobody else's text can command the terminal.

Sessions, bags, instructions and file names may hold escape sequences that set the window's title, hide a link behind
other words, move the cursor or reverse the direction of writing. Every character of that kind is written as its escape
`\\uXXXX`: it is seen, it does nothing, and in a line of JSON it still means the same character. Colours and cursor
movements of this tool itself go through `styled`, and what `console_on` makes.
"""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from rich.console import Console

# C0 but for tab and line feed, a carriage return that ends no line, DEL and C1; what changes the direction of writing;
# halves of surrogate pairs, which stand for single bytes of file names, C1 among them.
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]|\r(?!\n)")


def visible(text: str) -> str:
    """The text with every control character but tab and line feed written as `\\uXXXX`."""
    return _CONTROL.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


class VisibleText(io.TextIOWrapper):
    """A text file whose control characters are made visible."""

    def write(self, text: str) -> int:
        super().write(visible(text))
        return len(text)

    def write_styled(self, text: str) -> int:
        """Write what this tool itself says to the terminal, as it is."""
        return super().write(text)


class VisibleStream:
    """As `VisibleText`, around a stream that is there already and may be no file; everything else is the stream's."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        self._stream.write(visible(text))
        return len(text)

    def write_styled(self, text: str) -> int:
        """See `VisibleText`."""
        return self._stream.write(text)


class _Styled:
    """A stream that takes colours and cursor movements of this tool itself."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        return getattr(self._stream, "write_styled", self._stream.write)(text)


def styled(stream: TextIO) -> TextIO:
    """The same stream, for text that holds no other escape sequences than our own."""
    return _Styled(stream)  # type: ignore[return-value]  # all that is missing is the stream's


def console_on(stream: TextIO, **options: Any) -> Console:
    """A console of rich that draws its own colours and movements, and makes visible what is in the texts.

    Args:
        stream: what it writes to.
        options: as `rich.console.Console` takes them.
    """
    from collections.abc import Iterator

    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment

    class VisibleConsole(Console):
        def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
            for segment in super().render(renderable, options):
                text, style, control = segment
                if control is None and (style is None or style.link is None):
                    yield Segment(visible(text), style)
                elif control is None:
                    yield Segment(visible(text), style.update_link(None))  # it is written around the text
                else:
                    yield segment

    return VisibleConsole(file=styled(stream), **options)
