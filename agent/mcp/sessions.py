"""Let abandoned sessions over HTTP give way to new ones; a session at work is never taken.

Clients up to protocol version 2025-11-25 open a session, and many leave without closing it. Only what the protocol
says about sessions is used here: the header that names one, and the request that ends one.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

HEADER = "mcp-session-id"
_HEADER, _VERSION = HEADER.encode(), b"mcp-protocol-version"
_NOT_LET_IN = (401, 403, 421)  # statuses of a request from a page or a host that may not open a session either
_ORIGIN_OF_REQUEST = (b"host", b"origin", b"authorization")  # what the server checks of a request that ends a session


@dataclass
class _Session:
    """What is known of a session.

    Attributes:
        calls: requests and tools that are being answered now; while there is one, the session is at work.
        streams: open streams on which the client waits for messages.
        used: when it was at work last.
    """

    calls: int = 0
    streams: int = 0
    used: float = 0.0

    @property
    def order(self) -> tuple[bool, float]:
        """Order sessions by who gives way first: those whose client is gone, and of these the one idle for longest."""
        return self.streams > 0, self.used


class Sessions:
    """The sessions of a server, in the thread of its event loop.

    Args:
        most: how many there may be at the same time.
        clock: tells the time in seconds.
    """

    def __init__(self, most: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._most, self._clock, self._opening = most, clock, 0
        self._sessions: dict[str, _Session] = {}

    @contextmanager
    def working(self, name: str | None) -> Iterator[None]:
        """Mark a session as being at work in a `with` block; an unknown one is left out."""
        session = self._sessions.get(name or "")
        if session is None:
            yield
            return
        session.calls += 1
        try:
            yield
        finally:
            session.calls, session.used = session.calls - 1, self._clock()

    def giving_way(self, app: Any) -> Any:
        """Return an ASGI application that ends the session that is idle for longest before `app` opens one too many."""

        async def served(scope: Any, receive: Any, send: Any) -> None:
            if scope["type"] != "http":
                await app(scope, receive, send)
                return
            headers = dict(scope["headers"])
            name = headers.get(_HEADER, b"").decode("latin-1")
            if name:
                await self._serve_known(app, name, scope, receive, send)
            elif scope["method"] == "POST" and _opens(headers):
                await self._serve_opening(app, scope, receive, send)
            else:
                await app(scope, receive, send)

        return served

    async def _serve_known(self, app: Any, name: str, scope: Any, receive: Any, send: Any) -> None:
        """Serve a request of a session, and forget the session when it has ended."""

        async def watch(message: Any) -> None:
            if message["type"] == "http.response.start" and (message["status"] == 404 or scope["method"] == "DELETE"):
                self._sessions.pop(name, None)
            await send(message)

        session = self._sessions.get(name)
        if scope["method"] == "GET" and session is not None:
            session.streams += 1
            try:
                await app(scope, receive, watch)
            finally:
                session.streams -= 1
            return
        with self.working(name):
            await app(scope, receive, watch)

    async def _serve_opening(self, app: Any, scope: Any, receive: Any, send: Any) -> None:
        """Serve a request that may open a session; an idle one gives way if there are too many."""

        async def watch(message: Any) -> None:
            if message["type"] == "http.response.start" and message["status"] < 400:
                name = dict(message["headers"]).get(_HEADER)
                if name is not None:
                    self._sessions[name.decode("latin-1")] = _Session(used=self._clock())
            await send(message)

        self._opening += 1
        try:
            if len(self._sessions) + self._opening > self._most:
                await self._end_one(app, scope)
            await app(scope, receive, watch)
        finally:
            self._opening -= 1

    async def _end_one(self, app: Any, scope: Any) -> None:
        """End the session that gives way first, if there is one that is not at work."""
        idle = [(session.order, name) for name, session in self._sessions.items() if not session.calls]
        if not idle:
            return
        name, statuses = min(idle)[1], []
        session = self._sessions.pop(name)  # before anything is awaited: another request must not choose it too
        headers = [pair for pair in scope["headers"] if pair[0] in _ORIGIN_OF_REQUEST]

        async def receive() -> Any:
            return {"type": "http.request", "body": b"", "more_body": False}

        async def send(message: Any) -> None:
            if message["type"] == "http.response.start":
                statuses.append(message["status"])

        await app(
            {**scope, "method": "DELETE", "headers": [*headers, (_HEADER, name.encode("latin-1"))]}, receive, send
        )
        if statuses and statuses[0] in _NOT_LET_IN:
            self._sessions[name] = session


def _opens(headers: dict[bytes, bytes]) -> bool:
    """Return whether a request without a session can open one; from protocol version 2026-07-28 on there are none."""
    return headers.get(_VERSION, b"") < b"2026"
