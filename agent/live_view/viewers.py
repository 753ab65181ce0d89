"""Keep who watches, who drives, and what each viewer has yet to be sent; used in the thread of the server alone."""

from __future__ import annotations

import asyncio
import json
from collections import deque
from itertools import count
from secrets import token_hex
from typing import Any

MOST_LINES = 400  # of the conversation, that a new viewer gets
# Each message replaces the last one of its kind. What belongs to a scene is void with the next scene.
_OF_A_SCENE = ("poses", "candidates", "chosen", "preview")


class Viewer:
    """A connected page: its messages that wait, at most one of each kind besides entries of the conversation.

    Attributes:
        number: tells viewers apart.
        overrun: whether it reads so slowly that entries had to be dropped; it should be disconnected.
    """

    def __init__(self, number: int) -> None:
        self.number, self.overrun = number, False
        self._waiting: dict[str | int, str] = {}
        self._lines = count()
        self._some = asyncio.Event()

    def put(self, kind: str, message: str) -> None:
        """Add a message; one of the same kind that still waits is replaced, except for entries of the conversation."""
        key: str | int = next(self._lines) if kind == "entry" else kind
        self._waiting.pop(key, None)
        self._waiting[key] = message
        self.overrun = self.overrun or len(self._waiting) > 2 * MOST_LINES
        self._some.set()

    async def messages(self) -> list[str]:
        """Wait for messages, and take all of them in their order."""
        await self._some.wait()
        self._some.clear()
        waiting, self._waiting = self._waiting, {}
        return list(waiting.values())


class Viewers:
    """All connected pages, the one of them that drives, and the messages that a new one needs.

    Args:
        drivable: whether a page may drive; otherwise all of them watch.
    """

    def __init__(self, drivable: bool) -> None:
        self._drivable = drivable
        self._viewers: dict[int, Viewer] = {}
        self._numbers = count(1)
        self._state: dict[str, str] = {}
        self._entries: deque[str] = deque(maxlen=MOST_LINES)
        # By another start, a page that comes back knows that what it was told before is void.
        self._hello = json.dumps({"kind": "hello", "start": token_hex(8)})
        self._driver: Viewer | None = None

    def __len__(self) -> int:
        return len(self._viewers)

    def add(self, drives: bool) -> Viewer:
        """Add a viewer and give it the present state.

        Args:
            drives: whether it takes the driver's seat if nobody is in it.
        """
        viewer = Viewer(next(self._numbers))
        self._viewers[viewer.number] = viewer
        viewer.put("hello", self._hello)
        for entry in self._entries:
            viewer.put("entry", entry)
        for kind, message in self._state.items():
            viewer.put(kind, message)
        if drives and self._drivable and self._driver is None:
            self._driver = viewer
        return viewer

    def remove(self, viewer: Viewer) -> None:
        """Remove a viewer; if it drove, the seat is free from then on."""
        self._viewers.pop(viewer.number, None)
        if self._driver is viewer:
            self._driver = None

    def drives(self, viewer: Viewer) -> bool:
        """Return whether this viewer drives."""
        return self._driver is viewer

    def take_over(self, viewer: Viewer) -> None:
        """Let this viewer drive, and the driver so far watch."""
        if self._drivable and viewer.number in self._viewers:
            self._driver = viewer

    def roles(self) -> dict[int, dict[str, Any]]:
        """Return for each viewer's number who drives as seen by it: "you", "other", "nobody", or "terminal" where no
        page can."""

        def seen_by(viewer: Viewer) -> str:
            if not self._drivable:
                return "terminal"
            if self._driver is None:
                return "nobody"
            return "you" if self._driver is viewer else "other"

        return {
            number: {"kind": "roles", "driver": seen_by(viewer), "viewers": len(self._viewers)}
            for number, viewer in self._viewers.items()
        }

    def tell(self, viewer_number: int, kind: str, message: str) -> None:
        """Send a message to one viewer."""
        if viewer_number in self._viewers:
            self._viewers[viewer_number].put(kind, message)

    def tell_all(self, kind: str, message: str) -> None:
        """Send a message to all viewers, and keep it for those to come."""
        if kind == "entry":
            self._entries.append(message)
        else:
            if kind == "scene":
                for stale in _OF_A_SCENE:
                    self._state.pop(stale, None)
            self._state.pop(kind, None)
            self._state[kind] = message
        for viewer in self._viewers.values():
            viewer.put(kind, message)
