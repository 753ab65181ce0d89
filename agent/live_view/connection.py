"""Connect a page: every request is checked before the library reads it, and answered even if it is malformed."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from websockets.asyncio.server import ServerConnection

from agent.live_view.access import Refusal
from agent.live_view.request_head import END, LONGEST, Head, read_head, refusal_bytes

if TYPE_CHECKING:
    from collections.abc import Mapping

MOST_CONNECTIONS = 64  # at the same time; pages take one each, and a few for their files


class CheckedConnection(ServerConnection):
    """A connection whose request is checked first.

    Attributes:
        headers: of every answer; set by the server.
        body_wanted: whether the request wants more than the headers of an answer.
    """

    headers: Mapping[str, str] = {}
    _open = 0  # connections of this process

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._begun: bytearray | None = bytearray()  # of the head; `None` when it is read or refused
        self._refused = False
        self.body_wanted = True

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Count the connection; one too many is refused."""
        CheckedConnection._open += 1
        super().connection_made(transport)
        if CheckedConnection._open > MOST_CONNECTIONS:
            self._refuse(Refusal(503, f"there are {MOST_CONNECTIONS} connections already"))

    def connection_lost(self, exc: Exception | None) -> None:
        """Count the connection no more."""
        CheckedConnection._open -= 1
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take bytes: first the head of the request, then what belongs to the websocket."""
        if self._refused:
            return
        if self._begun is None:
            super().data_received(data)
            return
        searched = max(0, len(self._begun) - len(END))
        self._begun += data
        end = self._begun.find(END, searched)
        if end < 0:
            if len(self._begun) > LONGEST:
                self._refuse(Refusal(431, f"the headers of a request have at most {LONGEST} bytes"))
            return
        head = read_head(bytes(self._begun[: end + len(END)]))
        rest, self._begun = bytes(self._begun[end + len(END) :]), None
        if isinstance(head, Refusal):
            self._refuse(head)
        else:
            self._hand_on(head, rest)

    def _hand_on(self, head: Head, rest: bytes) -> None:
        self.body_wanted = head.method != "HEAD"
        super().data_received(head.raw + rest)

    def _refuse(self, refusal: Refusal) -> None:
        self._refused, self._begun = True, None
        self.transport.write(refusal_bytes(refusal, self.headers))
        self.transport.close()
