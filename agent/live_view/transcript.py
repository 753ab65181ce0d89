"""Show the chat in the page: what the screen of the chat says reaches it as typed entries, which the page lays out."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

from rich.text import Text

from agent.chat.view import ChatScreen, Surroundings
from agent.live_view.server import ViewServer
from agent.rendering.object_markers import Marker
from agent.rendering.text import duration, number
from agent.reporting.event_text import shortcoming
from agent.runtime.terminal_text import visible

_COLUMNS = re.compile(" {2,}")


class Transcript:
    """A printer of the chat (`agent.chat.text_printer.Printer`) whose pieces are messages of kind "entry".

    Each has a `type`: "said", "title", "rows", "line", "question" or "check". Control characters in their texts are
    made visible, those that reverse the direction of writing included.

    Args:
        server: sends the entries.
    """

    def __init__(self, server: ViewServer) -> None:
        self._server = server

    def said(self, line: str) -> None:
        """Send a line of the user."""
        self._send("said", text=line)

    def title(self, title: str, seconds: float | None = None) -> None:
        """Send the title of what follows, with the duration of its step."""
        self._send("title", text=title, took="" if seconds is None else duration(seconds))

    def rows(self, rows: Sequence[Sequence[str]]) -> None:
        """Send a table."""
        self._send("rows", rows=[list(row) for row in rows])

    def line(self, text: str, style: str = "") -> None:
        """Send a line; `style` has the words bold, dim, red and green."""
        self._send("line", text=text.strip(), style=style)

    def answer(self, text: str) -> None:
        """Send the lines of an answer; those with columns, which two spaces part, as a table."""
        lines = [_COLUMNS.split(line.strip()) for line in text.splitlines()]
        for in_columns, these in groupby(lines, lambda cells: len(cells) > 1):
            if in_columns:
                self.rows(list(these))
            else:
                for (line,) in these:
                    self.line(line)

    def question(self, question: str, options: Sequence[str]) -> None:
        """Send a question with its options."""
        self._send("question", text=question, options=list(options))

    def check(self, passed: bool, sentence: str) -> None:
        """Send a check that passed or failed."""
        self._send("check", passed=passed, text=sentence)

    def space(self) -> None:
        """Send nothing: the page sets what belongs together apart."""

    def _send(self, kind: str, **content: Any) -> None:
        self._server.publish("entry", {"type": kind, **_visible(content)})


def _visible(value: Any) -> Any:
    """Return JSON values with the control characters in their texts made visible."""
    if isinstance(value, str):
        return visible(value)
    if isinstance(value, list):
        return [_visible(one) for one in value]
    return {name: _visible(one) for name, one in value.items()} if isinstance(value, dict) else value


class _Captions:
    """A display of candidates that leaves the maps out, because the page shows them in three dimensions."""

    columns = 56

    def __init__(self, text: Transcript) -> None:
        self._text = text

    def beside(self, count: int) -> int:
        return self.columns

    def forget_key(self) -> None:
        """Do nothing: the names of the objects are in the view."""

    def show(self, scene: Mapping[str, Any], markers: Sequence[Marker]) -> None:
        """Do nothing: the table is in the view."""

    def show_candidates(
        self, scene: Mapping[str, Any], candidates: Sequence[Mapping[str, Any]], captions: Sequence[Sequence[Text]]
    ) -> None:
        best = candidates[0]["scores"]
        named = [f"arrangement {one['rank']}" for one in candidates]
        scored = [f"score {number(one['scores']['total'], 2)}" for one in candidates]
        if len(candidates) == 1:
            self._text.line(f"{named[0]}, {scored[0]}")
            return
        lacking = [shortcoming(one["scores"], best) if one["rank"] > 1 else "the best" for one in candidates]
        self._text.rows(list(zip(named, scored, lacking, strict=True)))

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
    text = Transcript(server)
    return ChatScreen(echo=echo, surroundings=Surroundings(text, _Captions(text), _Busy(server)))
