"""Exchange JSON objects with a rosbridge server over a websocket, in a thread of its own."""

from __future__ import annotations

import contextlib
import json
import math
import threading
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from agent.errors import RobotRefused, UsageError

if TYPE_CHECKING:
    from websockets.sync.client import ClientConnection

OPEN_SECONDS = 5.0
LARGEST = 2**22  # bytes of a message


def check_installed() -> None:
    """Check that the package for websockets is there.

    Raises:
        UsageError: without it.
    """
    try:
        import websockets.sync.client  # noqa: F401
    except ImportError as error:
        raise UsageError("a robot needs the package websockets: pip install 'structagent[robot]'") from error


class Connection:
    """A connection to one server; what arrives is handed on by its thread.

    Args:
        address: "ws://HOST:PORT".
        on_message: gets every JSON object that arrives.

    Attributes:
        lost: why the connection has ended; empty while it is open.
    """

    def __init__(self, address: str, on_message: Callable[[Mapping[str, Any]], None]) -> None:
        self.address, self._on_message = address, on_message
        self.lost = "not connected"
        self._socket: ClientConnection | None = None
        self._ends = contextlib.ExitStack()
        self._news = threading.Condition()

    def open(self, seconds: float = OPEN_SECONDS) -> None:
        """Connect.

        Raises:
            RobotRefused: if nobody answers there in `seconds`.
        """
        from websockets.exceptions import WebSocketException
        from websockets.sync.client import connect

        try:
            # A proxy of the environment is for pages, not for an arm; compression costs time; and the joint states
            # tell sooner than pings whether anybody is there.
            connecting = connect(
                self.address, open_timeout=seconds, close_timeout=0.2, ping_interval=None, max_size=LARGEST,
                compression=None, proxy=None,
            )  # fmt: skip
            socket = self._ends.enter_context(connecting)
        except (OSError, WebSocketException, TimeoutError) as error:
            why = str(error) or type(error).__name__
            raise RobotRefused(f"no rosbridge server answers at {self.address}: {why}") from error
        self._socket, self.lost = socket, ""
        threading.Thread(target=self._read, args=(socket,), name="rosbridge", daemon=True).start()

    def _read(self, socket: ClientConnection) -> None:
        from websockets.exceptions import WebSocketException

        why = "the server closed the connection"
        try:
            for text in socket:
                message = _parsed(text)
                if message is not None:
                    self._on_message(message)
                    with self._news:
                        self._news.notify_all()
        except (OSError, WebSocketException) as error:
            why = str(error)
        with self._news:
            if self._socket is socket:
                self.lost = f"the connection to {self.address} was lost: {why}"
            self._news.notify_all()

    def send(self, message: Mapping[str, Any]) -> bool:
        """Send a JSON object; return whether that was possible."""
        from websockets.exceptions import WebSocketException

        if self._socket is None or self.lost:
            return False
        try:
            self._socket.send(json.dumps(message, allow_nan=False))
        except (OSError, WebSocketException) as error:
            self.lost = f"the connection to {self.address} was lost: {error}"
            return False
        return True

    def wait(self, seconds: float) -> None:
        """Return after `seconds`, or earlier where something has arrived."""
        with self._news:
            if self.lost:
                time.sleep(seconds)
            else:
                self._news.wait(seconds)

    def close(self) -> None:
        """Disconnect."""
        self._socket, self.lost = None, "not connected"
        self._ends.close()


def _parsed(text: str | bytes) -> Mapping[str, Any] | None:
    """Return a message; `None` for what is none. JSON of other programs may have NaN, and `null` in its place."""
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return message if isinstance(message, dict) else None


def number(value: object) -> float:
    """Return a number of a message; NaN for anything else."""
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
