"""Exchange one question and its answer with a server, limited in time and size whatever the server does."""

from __future__ import annotations

import socket
import ssl
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import httpx


THREAD = "language model exchange"
MAX_REFUSAL_BYTES = 16 * 1024  # what a refusal says after that is left out


@dataclass(frozen=True)
class Answer:
    """What a server answers.

    Attributes:
        status: 200, or that of a refusal.
        body: its bytes; of a refusal the first `MAX_REFUSAL_BYTES`.
        headers: with names in lower case.
    """

    status: int
    body: bytes
    headers: Mapping[str, str]

    @property
    def text(self) -> str:
        """Decode the body."""
        return self.body.decode("utf-8", "replace")


class ExchangeError(Exception):
    """A question without an answer; the message says what the server did and is meant to follow its name."""


class Exchange:
    """A sender of JSON to one server.

    A server can send header after header, or one `100 Continue` after another, and every byte would begin a
    library's time-out anew. So the exchange runs in a thread, whose sockets are shut down when the time is over.

    Args:
        url: the address for questions.
        headers: sent with every question.
        connect_seconds: how long a connection may take.
        answer_seconds: how long all of it may take, from looking up the name to the answer's last byte.
        most_bytes: of an answer.
    """

    def __init__(
        self,
        url: str,
        headers: Mapping[str, str],
        connect_seconds: float,
        answer_seconds: float,
        most_bytes: int,
    ) -> None:
        self._url, self._headers, self._most_bytes = url, dict(headers), most_bytes
        self._connect_seconds, self._answer_seconds = connect_seconds, answer_seconds
        self._sockets: list[socket.socket] = []

    def post(self, body: dict[str, Any]) -> Answer:
        """Post a request.

        Raises:
            ExchangeError: for a server that cannot be reached, is not trusted, is too slow or says too much.
        """
        return self._ask("POST", self._url, {"json": body})

    def get(self, url: str) -> Answer:
        """Ask for another address of the same server; errors as in `post`."""
        return self._ask("GET", url, {})

    def _ask(self, method: str, url: str, content: dict[str, Any]) -> Answer:
        given_up = threading.Event()
        outcome: list[Answer | Exception] = []

        def work() -> None:
            try:
                outcome.append(self._talk(method, url, content, given_up))
            except Exception as error:  # raised in the thread that asked
                outcome.append(error)

        thread = threading.Thread(target=work, name=THREAD, daemon=True)
        thread.start()
        try:
            thread.join(self._answer_seconds)
        finally:  # also where the user interrupts
            if not outcome:
                given_up.set()
                self._hang_up()
        if not outcome:
            raise self._too_slow()
        if isinstance(outcome[0], Exception):
            raise outcome[0]
        return outcome[0]

    def _talk(self, method: str, url: str, content: dict[str, Any], given_up: threading.Event) -> Answer:
        import httpx

        def trace(event: str, info: dict[str, Any]) -> None:
            if given_up.is_set():
                raise self._too_slow()
            if event.endswith(("connect_tcp.complete", "start_tls.complete")):
                opened = info["return_value"].get_extra_info("socket")
                self._sockets = [*(each for each in self._sockets if each.fileno() >= 0), opened]

        received = b""
        try:
            with self._client.stream(method, url, extensions={"trace": trace}, **content) as response:
                refused = response.status_code != 200
                headers = {name.lower(): value for name, value in response.headers.items()}
                for piece in response.iter_raw():  # not unpacked: small bytes could become large ones
                    received += piece
                    if refused and len(received) >= MAX_REFUSAL_BYTES:
                        break
                    if len(received) > self._most_bytes:
                        raise ExchangeError(f"answered with more than {self._most_bytes // 1024} KiB")
                return Answer(response.status_code, received[: MAX_REFUSAL_BYTES if refused else None], headers)
        except httpx.ConnectTimeout as error:
            raise ExchangeError(f"could not be reached within {self._connect_seconds:g} s") from error
        except httpx.TimeoutException as error:
            raise self._too_slow() from error
        except (httpx.HTTPError, httpx.InvalidURL, OSError, ValueError) as error:
            raise ExchangeError(why_not(error)) from error

    def _too_slow(self) -> ExchangeError:
        return ExchangeError(f"took longer than {self._answer_seconds:g} s to answer")

    def _hang_up(self) -> None:
        """End the reading of an abandoned thread; the next question opens another connection."""
        for each in self._sockets:
            try:
                socket.socket.shutdown(each, socket.SHUT_RDWR)  # not TLS's own, which is in use in the thread
            except OSError:
                continue  # closed meanwhile
        self._sockets = []
        self.__dict__.pop("_client", None)

    @cached_property
    def _client(self) -> httpx.Client:
        import httpx

        timeout = httpx.Timeout(self._answer_seconds, connect=self._connect_seconds)
        return httpx.Client(timeout=timeout, headers=self._headers, follow_redirects=False)


def why_not(error: BaseException) -> str:
    """Explain a failed connection without the error's own words, which could hold a key."""
    kinds: list[str] = []
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, ssl.SSLCertVerificationError):
            return (
                f"has a certificate that is not trusted ({cause.verify_message.rstrip('.')}); if you trust it, name "
                "the file of its authority's certificate in SSL_CERT_FILE"
            )
        if isinstance(cause, ssl.SSLError):
            return "does not speak TLS, as an https address asks for"
        kinds.append(type(cause).__name__)
        cause = cause.__cause__ or cause.__context__
    return (
        "could not be reached"
        if "ConnectError" in kinds
        else f"could not be reached: communication failed ({kinds[0]})"
    )
