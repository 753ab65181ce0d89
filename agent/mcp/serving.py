"""Serve a table over standard input and output, or over HTTP to those who may ask."""

from __future__ import annotations

import hmac
import ipaddress
import os
import secrets
import signal
import socket
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import anyio
import uvicorn
from mcp.server.transport_security import TransportSecuritySettings

from agent.errors import BadInput, UsageError
from agent.mcp.audit import AuditLog
from agent.mcp.server import MOST_SESSIONS, TableServer, make_server
from agent.mcp.shared_table import SharedTable
from agent.mcp.worker import TableWorker
from agent.pipeline.run import RunOptions
from agent.runtime.settings import TOKEN_VARIABLE

PATH = "/mcp"
_LEAST_TOKEN = 16  # characters
_IDLE_SECONDS = 300.0  # after which a session without a request or an open stream ends
_LARGEST_REQUEST = 256 * 1024  # bytes
_SECONDS_TO_END = 3  # that open streams get when the server ends
_LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
_ANY_ADDRESS = ("0.0.0.0", "::")

Say = Callable[[str], None]


@dataclass(frozen=True)
class Address:
    """Where the server listens.

    Attributes:
        host: a name or an address.
        port: 0 for any that is free.
        allowed: further hosts by which clients may call it.
        token: what clients have to send; `None` to require none on this machine, and to make one otherwise.
    """

    host: str = "127.0.0.1"
    port: int = 8321
    allowed: Sequence[str] = ()
    token: str | None = None

    @property
    def is_loopback(self) -> bool:
        """Return whether only programs on this machine can reach it."""
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return self.host == "localhost"

    @property
    def url_host(self) -> str:
        """Return the host as it stands in a URL."""
        return f"[{self.host}]" if ":" in self.host else self.host


def serve(options: RunOptions, folder: Path, audit: Path, approve_all: bool, address: Address | None, say: Say) -> None:
    """Set the table and serve it until the client is gone, or for HTTP until somebody interrupts it.

    Args:
        options: the options of a run; its scene is the table.
        folder: of the session.
        audit: the file of the audit log.
        approve_all: whether things move without asking a person.
        address: where to listen; `None` for standard input and output.
        say: takes lines for the person who started it.

    Raises:
        UsageError: for a token that is too short.
        BadInput: if nobody can listen there.
        NotWritten: if the session or the audit log cannot be written.
        AgentError: if there is no such table.
    """
    with ExitStack() as until_served:
        worker = TableWorker()
        until_served.callback(worker.close)
        table = worker.at_once(lambda: SharedTable(options, folder))
        until_served.callback(lambda: worker.at_once(table.close))
        log = until_served.enter_context(AuditLog(audit))
        server = make_server(table, worker, log, approve_all)
        say(f"session: {folder}; audit log: {audit}")
        if approve_all:
            say("the arm moves without asking anyone (--approve-all)")
        if address is None:
            table.preload()
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                signal.signal(number, _end_at_once)
            say("serving on standard input and output")
            anyio.run(server.run_stdio_async)
        else:
            web, listening = http_server(server, address, say)
            table.preload()
            anyio.run(lambda: web.serve(sockets=[listening]))


def _end_at_once(number: int, frame: FrameType | None) -> None:
    """End the process; a thread that waits for a line of the client would keep any other end waiting too."""
    with suppress(OSError):  # `print` may be what was interrupted
        os.write(2, b"structagent: interrupted\n" if number == signal.SIGINT else b"structagent: terminated\n")
    os._exit(128 + number)


def http_server(server: TableServer, address: Address, say: Say) -> tuple[uvicorn.Server, socket.socket]:
    """Return a web server for a server of tools, and the socket that it listens on.

    Raises:
        UsageError: for a token that is too short.
        BadInput: if nobody can listen there.
    """
    token = address.token
    if token is not None and len(token) < _LEAST_TOKEN:
        raise UsageError(f"{TOKEN_VARIABLE} must have {_LEAST_TOKEN} characters or more, but it has {len(token)}")
    listening = _listen(address)
    port = listening.getsockname()[1]
    made = token is None and not address.is_loopback
    if made:
        token = secrets.token_urlsafe(32)
    app: Any = server.streamable_http_app(
        streamable_http_path=PATH,
        max_request_body_size=_LARGEST_REQUEST,
        session_idle_timeout=_IDLE_SECONDS,
        max_sessions=MOST_SESSIONS,
        transport_security=_security(address, port),
    )
    app = server.sessions.giving_way(app)
    if token is not None:
        app = _with_token(app, token)
    say(f"serving on http://{address.url_host}:{port}{PATH}")
    if made:
        say(f"clients need the header Authorization: Bearer {token}")
    config = uvicorn.Config(app, log_level="error", timeout_graceful_shutdown=_SECONDS_TO_END, lifespan="on")
    return uvicorn.Server(config), listening


def _listen(address: Address) -> socket.socket:
    family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
    try:
        return socket.create_server((address.host, address.port), family=family)
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise BadInput(f"cannot listen on {address.url_host}:{address.port}: {reason.lower()}") from error


def _security(address: Address, port: int) -> TransportSecuritySettings:
    """Return which hosts a request may name and which pages may send one, against pages that rebind a name to here."""
    named = [] if address.host in _ANY_ADDRESS else [address.url_host]
    names = [*_LOOPBACK, *named, *address.allowed]
    hosts = [host for name in names for host in ((name,) if _has_port(name) else (name, f"{name}:{port}"))]
    origins = [f"{scheme}://{host}" for host in hosts for scheme in ("http", "https")]
    return TransportSecuritySettings(allowed_hosts=hosts, allowed_origins=origins)


def _has_port(name: str) -> bool:
    return name.rpartition(":")[2].isdecimal() and not name.endswith("]")


def _with_token(app: Any, token: str) -> Any:
    """Return an ASGI application that answers nobody without the token."""
    expected = token.encode()

    async def guarded(scope: Any, receive: Any, send: Any) -> None:
        if scope["type"] == "http":
            given = next((value for name, value in scope["headers"] if name == b"authorization"), b"")
            scheme, _, value = given.partition(b" ")
            if scheme.lower() != b"bearer" or not hmac.compare_digest(value, expected):
                headers = [(b"www-authenticate", b"Bearer"), (b"content-type", b"text/plain")]
                await send({"type": "http.response.start", "status": 401, "headers": headers})
                await send({"type": "http.response.body", "body": b"this server needs its bearer token\n"})
                return
        await app(scope, receive, send)

    return guarded
