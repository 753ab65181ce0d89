"""Make control characters visible in text for the terminal, so that foreign text cannot control it.

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
    """Return the text with every control character except tab and line feed written as `\\uXXXX`."""
    return _CONTROL.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


class VisibleText(io.TextIOWrapper):
    """A text file that writes control characters in visible form."""

    def write(self, text: str) -> int:
        super().write(visible(text))
        return len(text)

    def write_styled(self, text: str) -> int:
        """Write the tool's own text to the terminal unchanged."""
        return super().write(text)


class VisibleStream:
    """A wrapper like `VisibleText` around an existing stream, which need not be a file; other attributes are the
    stream's.
    """

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
    """A stream that accepts the tool's own colours and cursor movements."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        return getattr(self._stream, "write_styled", self._stream.write)(text)


def styled(stream: TextIO) -> TextIO:
    """Return the same stream for text whose only escape sequences are the tool's own."""
    return _Styled(stream)  # type: ignore[return-value]  # all that is missing is the stream's


def console_on(stream: TextIO, **options: Any) -> Console:
    """Create a rich console that emits its own colours and movements and makes control characters in texts visible.

    Args:
        stream: the stream that it writes to.
        options: as for `rich.console.Console`.
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
                elif control is None and style is not None:
                    yield Segment(visible(text), style.update_link(None))  # it is written around the text
                else:
                    yield segment

    return VisibleConsole(file=styled(stream), **options)
