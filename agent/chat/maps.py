"""Draw the maps of a chat: the table from above in characters, its stacks from the side, and a legend."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.text import Text

from agent.rendering import terminal_canvas
from agent.rendering.object_markers import Marker, markers_of_candidate, markers_of_scene
from agent.rendering.side_view import side_view

_COLUMNS = 56  # width of a single map
_BESIDE_COLUMNS = 38  # width of a map beside others
_LEAST_COLUMNS = 18  # least width of a map with a caption; if it does not fit beside the others, it goes below
_WIDE = 100  # least columns of a terminal for three maps side by side


class Maps:
    """Maps on a console, each with its key unless the same key was shown last.

    Args:
        console: the console to draw on.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._colors = terminal_canvas.colors_of(console)
        self._key: list[str] = []

    @property
    def columns(self) -> int:
        """Return the width of a single map, columns."""
        return max(min(_COLUMNS, self._console.width), terminal_canvas.LEAST_COLUMNS)

    def beside(self, count: int, most: int = _BESIDE_COLUMNS) -> int:
        """Return the width of one of `count` maps, columns; up to three share a row if the terminal is wide enough."""
        if count < 2:
            return self.columns
        count = min(count, 3 if self._console.width >= _WIDE else 2)
        fitting = (self._console.width - 2 * (count - 1)) // count
        return min(max(_LEAST_COLUMNS, min(most, fitting)), max(self._console.width, terminal_canvas.LEAST_COLUMNS))

    def forget_key(self) -> None:
        """Show the key with the next map even if it was shown last."""
        self._key = []

    def show(self, scene: Mapping[str, Any], markers: Sequence[Marker]) -> None:
        """Show one map as large as fits, and its key.

        Args:
            scene: an event `Perceived` in its JSON form.
            markers: the objects on the table.
        """
        self._print(self._drawn(scene, markers, self.columns))
        self._show_key(scene)

    def show_candidates(
        self, scene: Mapping[str, Any], candidates: Sequence[Mapping[str, Any]], captions: Sequence[Sequence[Text]]
    ) -> None:
        """Show candidates side by side, as many as fit, each with its caption, and one key for all."""
        columns = self.beside(len(candidates))
        drawn = [
            self._drawn(scene, markers_of_candidate(scene, one["positions"], one["turns"]), columns)
            for one in candidates
        ]
        self._print(terminal_canvas.side_by_side(drawn, captions, self._console.width))
        self._show_key(scene)

    def previews(self, scene: Mapping[str, Any], payload: Mapping[str, Any], columns: int) -> list[Text]:
        """Return the samples of an event `Previewed` in its JSON form, side by side, seen from above only."""
        width = min(self.beside(len(payload["positions"]), columns), columns)
        pictures = [
            terminal_canvas.picture(markers_of_candidate(scene, positions, turns), scene["table"], width, self._colors)
            for positions, turns in zip(payload["positions"], payload["turns"], strict=True)
        ]
        return terminal_canvas.side_by_side(pictures, [[] for _ in pictures], self._console.width)

    def _drawn(self, scene: Mapping[str, Any], markers: Sequence[Marker], columns: int) -> list[Text]:
        above = terminal_canvas.picture(markers, scene["table"], columns, self._colors)
        return [*above, *side_view(markers, scene["table"], columns, self._colors)]

    def _show_key(self, scene: Mapping[str, Any]) -> None:
        lines = terminal_canvas.legend(markers_of_scene(scene), self._console.width, self._colors)
        plain = [line.plain for line in lines]
        if plain != self._key:
            self._key = plain
            self._print(lines)

    def _print(self, lines: Sequence[Text]) -> None:
        for line in lines:
            self._console.print(line, highlight=False, soft_wrap=True)
