"""Show work in progress on a terminal; show nothing if there is no terminal."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.live import Live
from rich.spinner import Spinner
from rich.text import Text


class LiveDisplay:
    """A region of the terminal that is redrawn while work is in progress and then removed.

    Args:
        console: the console to draw on.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live: Live | None = None

    @property
    def possible(self) -> bool:
        """Return whether the console is a terminal that can move its cursor."""
        return self._console.is_terminal and not self._console.is_dumb_terminal

    def spin(self, message: str) -> None:
        """Show a spinner with a message until `stop`."""
        if self.possible:
            self._show(Spinner("dots", Text(message, "dim")), moving=True)

    def draw(self, content: Any) -> None:
        """Show the content instead of the present one until `stop`."""
        if self.possible:
            self._show(content, moving=False)

    def stop(self) -> None:
        """Remove the region."""
        if self._live is not None:
            self._live.stop()
            self._live = None

    def _show(self, content: Any, moving: bool) -> None:
        if self._live is not None and self._live.auto_refresh != moving:
            self.stop()
        if self._live is None:
            self._live = Live(content, console=self._console, transient=True, auto_refresh=moving, refresh_per_second=8)
            self._live.start()
        self._live.update(content, refresh=True)
