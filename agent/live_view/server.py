"""Serve the page and its websocket from a thread of their own: requests are checked before anything is answered."""

from __future__ import annotations

import asyncio
import json
import logging
import mimetypes
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import suppress
from http import HTTPStatus
from importlib.resources import files
from threading import Thread
from typing import TYPE_CHECKING, Any, Self

from agent.errors import UsageError
from agent.live_view.access import LOOPBACK, Access, is_loopback, new_token
from agent.live_view.viewers import Viewer, Viewers

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

    from agent.live_view.connection import CheckedConnection

MOST_VIEWERS = 16
LONGEST_MESSAGE = 16_384  # bytes from a page: more than any instruction needs
_ENDING = 5.0  # s that the pages have to be told
_SOCKET = "/socket"
_PAGES = {"/": "index.html"} | {
    f"/{name}": name
    for name in (
        "live_view.css", "chat.css", "live_view.js", "elements.js", "transcript.js", "candidates.js", "thumbnails.js",
        "scene_3d.js", "arranging.js", "eye.js", "shaders.js", "solids.js", "matrices.js",
    )
}  # fmt: skip
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


def check_installed() -> None:
    """Check that the package that the view needs is there.

    Raises:
        UsageError: if it is not.
    """
    try:
        import websockets.asyncio.server  # noqa: F401
    except ImportError as error:
        message = "the live view needs the package websockets: pip install 'structagent[view]'"
        raise UsageError(message) from error


def server_beside(port: int) -> ViewServer:
    """Return a server for pages of this machine that only watch, on this port or, if it is in use, on a free one.

    Raises:
        UsageError: without the package.
    """
    check_installed()
    try:
        return ViewServer(LOOPBACK, port)
    except UsageError:
        return ViewServer(LOOPBACK, 0)


# What the driver asks for, by the kind of its message, with the message.
Actions = Mapping[str, Callable[[Mapping[str, Any]], str]]


class ViewServer:
    """A server of the page; use it in a `with` block, which ends it.

    Args:
        host: the address to listen on.
        port: the port; 0 takes a free one.
        token: whether a token is needed on an address of this machine too; on any other it always is.
        actions: what the driver can do: kind of message -> a function that gets the message in the server's thread, and
            returns why it is refused, or an empty text. Without actions all pages watch.

    Raises:
        UsageError: without the package, and for an address that cannot be listened on.
    """

    def __init__(self, host: str, port: int, token: bool = False, actions: Actions | None = None) -> None:
        check_installed()
        self._actions = actions or {}
        self._viewers = Viewers(drivable=actions is not None)
        self._token = new_token() if token or not is_loopback(host) else None
        self._loop = asyncio.new_event_loop()
        self._ended: asyncio.Event | None = None
        listening: Future[int] = Future()
        self._thread = Thread(target=self._run, args=(host, port, listening), name="live view", daemon=True)
        self._thread.start()
        try:
            self.access = Access(host, listening.result(), self._token)
        except (OSError, OverflowError) as error:
            raise UsageError(_not_listening(host, port, error)) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def watched(self) -> bool:
        """Return whether any page is open."""
        return len(self._viewers) > 0

    def publish(self, kind: str, payload: Mapping[str, Any]) -> None:
        """Send a message to all pages, those to come included; may be called in any thread.

        Args:
            kind: the kind; the last message of each kind is kept, of "entry" the last ones.
            payload: the message as JSON values.
        """
        message = json.dumps({"kind": kind, **payload}, separators=(",", ":"))
        with suppress(RuntimeError):  # the server has ended
            self._loop.call_soon_threadsafe(self._viewers.tell_all, kind, message)

    def close(self) -> None:
        """Tell the pages that this is the end, and end the server."""
        if self._ended is not None:
            with suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join(_ENDING)

    # --- in the server's thread --------------------------------------------------------------

    def _run(self, host: str, port: int, listening: Future[int]) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve(host, port, listening))
        except Exception as error:
            if listening.done():
                raise
            listening.set_exception(error)
        finally:
            self._loop.close()

    async def _serve(self, host: str, port: int, listening: Future[int]) -> None:
        from websockets.asyncio.server import serve

        from agent.live_view.connection import CheckedConnection

        quiet = logging.getLogger("agent.live_view.websockets")
        quiet.setLevel(logging.CRITICAL)  # a connection that breaks off is nothing to report
        self._ended = asyncio.Event()
        CheckedConnection.headers = _HEADERS
        options: dict[str, Any] = {
            "max_size": LONGEST_MESSAGE,
            "max_queue": 4,
            "compression": None,
            "server_header": None,
            "process_request": self._answer,
        }
        async with serve(
            self._connected, host, port, logger=quiet, create_connection=CheckedConnection, **options
        ) as server:
            found = next(iter(server.sockets)).getsockname()[1]
            self.access = Access(host, found, self._token)  # before the first request is answered
            listening.set_result(found)
            await self._ended.wait()

    def _answer(self, connection: CheckedConnection, request: Request) -> Response | None:
        """Answer a request for a file; return `None` for the websocket, after the same checks."""
        response = self._whole_answer(connection, request)
        if response is not None and not connection.body_wanted:
            response.body = b""
        return response

    def _whole_answer(self, connection: CheckedConnection, request: Request) -> Response | None:
        path = request.path.partition("?")[0]
        refusal = self.access.refusal(request.path, request.headers)
        if refusal is not None:
            return _response(refusal.status, refusal.reason.encode())
        if path == _SOCKET and connection.body_wanted and "upgrade" in request.headers.get("Connection", "").lower():
            full = len(self._viewers) >= MOST_VIEWERS
            return _response(503, f"there are {MOST_VIEWERS} viewers already".encode()) if full else None
        if path == "/" and self.access.has_token_in(request.path):
            cookie = f"{self.access.cookie}={self.access.token}; Path=/; HttpOnly; SameSite=Lax"
            return _response(303, b"", {"Location": "/", "Set-Cookie": cookie})
        name = _PAGES.get(path)
        if name is None:
            return _response(404, b"there is no such page")
        content = files("agent.live_view").joinpath("page", name).read_bytes()
        return _response(200, content, {"Content-Type": _content_type(name)})

    async def _connected(self, connection: ServerConnection) -> None:
        """Serve one page until it leaves: send what is new, and carry out what the driver asks for."""
        from websockets.exceptions import ConnectionClosed

        assert connection.request is not None  # it was answered
        viewer = self._viewers.add(drives="again" not in connection.request.path.partition("?")[2])
        self._tell_roles()
        sending = asyncio.create_task(self._send(connection, viewer))
        ending = asyncio.create_task(self._close_at_the_end(connection))
        try:
            async for message in connection:
                self._take(viewer, message)
        except ConnectionClosed:
            pass
        finally:
            sending.cancel()
            ending.cancel()
            self._viewers.remove(viewer)
            self._tell_roles()

    async def _send(self, connection: ServerConnection, viewer: Viewer) -> None:
        from websockets.exceptions import ConnectionClosed

        with suppress(ConnectionClosed):
            while not viewer.overrun:
                for message in await viewer.messages():
                    await connection.send(message)
            await connection.close(1013, "this page reads too slowly")

    async def _close_at_the_end(self, connection: ServerConnection) -> None:
        assert self._ended is not None  # set before the first connection
        await self._ended.wait()
        await connection.close(1001, "structagent has ended")

    def _take(self, viewer: Viewer, message: str | bytes) -> None:
        """Carry out a message of a page; what cannot be carried out is answered with the reason."""
        try:
            asked = json.loads(message)
            kind = str(asked["kind"])
        except (ValueError, TypeError, KeyError, RecursionError):
            refused = "a message of the page was not understood"
        else:
            refused = self._carried_out(viewer, kind, asked)
        if refused:
            self._viewers.tell(viewer.number, "refused", json.dumps({"kind": "refused", "reason": refused}))

    def _carried_out(self, viewer: Viewer, kind: str, asked: Mapping[str, Any]) -> str:
        if kind == "take_over" and self._actions:
            self._viewers.take_over(viewer)
            self._tell_roles()
            return ""
        if kind not in self._actions:
            return f"this view has no {kind[:40]!r}"
        if not self._viewers.drives(viewer):
            return "this page watches; take over to drive"
        return self._actions[kind](asked)

    def _tell_roles(self) -> None:
        for number, roles in self._viewers.roles().items():
            self._viewers.tell(number, "roles", json.dumps(roles))


def _response(status: int, body: bytes, headers: Mapping[str, str] | None = None) -> Response:
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    all_headers = {
        **_HEADERS,
        "Content-Type": "text/plain; charset=utf-8",
        "Content-Length": str(len(body)),
        "Connection": "close",
        **(headers or {}),
    }
    return Response(status, HTTPStatus(status).phrase, Headers(all_headers), body)


def _content_type(name: str) -> str:
    kind = "text/javascript" if name.endswith(".js") else mimetypes.guess_type(name)[0]
    return f"{kind}; charset=utf-8"


def _not_listening(host: str, port: int, error: Exception) -> str:
    reason = getattr(error, "strerror", None) or str(error)
    if isinstance(error, OSError) and "in use" in reason.lower():
        return f"port {port} of {host} is in use by another program; --port 0 takes a free one"
    return f"cannot listen on {host}, port {port}: {reason}"
