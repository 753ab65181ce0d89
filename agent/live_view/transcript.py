"""Show the chat in the page: the screen of the terminal's chat, whose lines go to the page as text with styles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TextIO, cast

from rich.ansi import AnsiDecoder
from rich.console import Console
from rich.text import Text

from agent.chat.view import ChatScreen, Surroundings
from agent.live_view.server import ViewServer
from agent.rendering.object_markers import Marker
from agent.runtime.terminal_text import console_on

_WIDTH = 400  # columns: the page wraps lines itself, according to its width


class Transcript:
    """A stream of text for a console: each line is sent to the page with its styles.

    Args:
        server: sends the lines.
    """

    encoding = "utf-8"

    def __init__(self, server: ViewServer) -> None:
        self._server, self._decoder, self._begun = server, AnsiDecoder(), ""

    def write(self, text: str) -> int:
        """Take text; send the lines that are complete."""
        *lines, self._begun = (self._begun + text).split("\n")
        for line in lines:
            self._server.publish("text", {"parts": _parts(self._decoder.decode_line(line))})
        return len(text)

    def flush(self) -> None:
        """Do nothing: a line is sent when it is complete."""

    def isatty(self) -> bool:
        """Return `False`: there is no cursor to move."""
        return False


def _parts(line: Text) -> list[list[str]]:
    """Return (text, names of styles) of the pieces of a line."""
    pieces = []
    for text, style, _ in line.render(_PLAIN):
        names = [name for name in ("bold", "dim") if style is not None and getattr(style, name)]
        if style is not None and style.color is not None and not style.color.is_default:
            names.append(_COLORS.get(style.color.number, ""))
        if text:
            pieces.append([text, " ".join(filter(None, names))])
    return pieces


_PLAIN = Console(color_system=None)
_COLORS = {1: "red", 2: "green", 6: "cyan"}  # of a terminal, by their numbers; the page has no others


class _Captions:
    """A display of candidates that leaves the maps out, because the page shows them in three dimensions."""

    columns = 56

    def __init__(self, console: Console) -> None:
        self._console = console

    def beside(self, count: int) -> int:
        return self.columns

    def forget_key(self) -> None:
        """Do nothing: the names of the objects are in the view."""

    def show(self, scene: Mapping[str, Any], markers: Sequence[Marker]) -> None:
        """Do nothing: the table is in the view."""

    def show_candidates(
        self, scene: Mapping[str, Any], candidates: Sequence[Mapping[str, Any]], captions: Sequence[Sequence[Text]]
    ) -> None:
        for caption in captions:
            for line in caption:
                self._console.print(Text("  ") + line, highlight=False, soft_wrap=True)

    def previews(self, scene: Mapping[str, Any], payload: Mapping[str, Any], columns: int) -> list[Text]:
        return []  # the view shows the samples


class _Busy:
    """A display of work in progress in the page."""

    possible = False  # to draw in the middle of the text

    def __init__(self, server: ViewServer) -> None:
        self._server, self._shown = server, ""

    def spin(self, message: str) -> None:
        self._show(message)

    def draw(self, content: Any) -> None:
        """Do nothing: nothing is drawn in the text."""

    def stop(self) -> None:
        self._show("")

    def _show(self, message: str) -> None:
        if message != self._shown:
            self._shown = message
            self._server.publish("busy", {"what": message})


def page_screen(server: ViewServer, echo: bool) -> ChatScreen:
    """Return a screen of the chat in the page.

    Args:
        server: sends what is shown.
        echo: whether the lines of the user are shown too, because they are typed elsewhere.
    """
    stream = cast(TextIO, Transcript(server))
    console = console_on(
        stream, width=_WIDTH, force_terminal=True, color_system="standard", legacy_windows=False, markup=False
    )
    return ChatScreen(console, echo, Surroundings(_Captions(console), _Busy(server)))
