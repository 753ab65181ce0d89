"""Real servers on free ports, and clients that read what a page would."""

import json
import time
import urllib.error
import urllib.request
from contextlib import ExitStack

import pytest

from agent.live_view.server import ViewServer

SECONDS = 10.0  # that a message may take


class Client:
    """A page without a browser: the messages that it got, in order."""

    def __init__(self, server: ViewServer, query: str = "", **options) -> None:
        from websockets.sync.client import connect

        self._open = ExitStack()
        address = address_of(server, f"/socket{query}").replace("http", "ws", 1)
        self.socket = self._open.enter_context(connect(address, **options))
        self.messages: list[dict] = []

    def until(self, found, seconds: float = SECONDS):
        """Read messages until `found` (a kind, or a function of a message) holds; return that message."""
        wanted = (lambda message: message["kind"] == found) if isinstance(found, str) else found
        end = time.monotonic() + seconds
        while True:
            self.messages.append(json.loads(self.socket.recv(timeout=max(0.01, end - time.monotonic()))))
            if wanted(self.messages[-1]):
                return self.messages[-1]

    def of(self, kind: str) -> list[dict]:
        return [message for message in self.messages if message["kind"] == kind]

    @property
    def text(self) -> str:
        """The entries of the conversation, one a line; what the user said after "> "."""
        return "\n".join(words_of(message) for message in self.of("entry"))

    def send(self, **message) -> None:
        self.socket.send(json.dumps(message))

    def close(self) -> None:
        self._open.close()


def words_of(entry: dict) -> str:
    """The words of an entry of the conversation."""
    rows = [" ".join(row) for row in entry.get("rows", [])]
    said = "> " * (entry["type"] == "said")
    return "\n".join(filter(None, (said + entry.get("text", ""), *entry.get("options", []), *rows)))


def address_of(server: ViewServer, path: str = "/") -> str:
    return f"http://127.0.0.1:{server.access.port}{path}"


def get(url: str, **headers: str) -> tuple[int, dict[str, str], bytes]:
    """Return the status, the headers and the body of the answer; redirections are not followed."""

    class NoRedirect(urllib.request.HTTPRedirectHandler):
        def redirect_request(self, *_):
            return None

    request = urllib.request.Request(url, headers={name.replace("_", "-"): value for name, value in headers.items()})
    try:
        with urllib.request.build_opener(NoRedirect).open(request, timeout=SECONDS) as answer:
            return answer.status, dict(answer.headers), answer.read()
    except urllib.error.HTTPError as error:
        return error.code, dict(error.headers), error.read()


@pytest.fixture
def watched():
    """A server whose pages watch."""
    with ViewServer("127.0.0.1", 0) as server:
        yield server


@pytest.fixture
def join():
    """Connect clients to a server; they are closed in the end."""
    clients = []

    def joined(server, query="", **options) -> Client:
        clients.append(Client(server, query, **options))
        return clients[-1]

    yield joined
    for client in clients:
        client.close()
