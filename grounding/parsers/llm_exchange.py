"""Exchange one question and its answer with a server, limited in time and size whatever the server does."""

from __future__ import annotations

import socket
import ssl
import threading
from functools import cached_property
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    import httpx


THREAD = "language model exchange"


class ExchangeError(Exception):
    """A question without an answer; the message says what the server did and is meant to follow its name."""


class Exchange:
    """A sender of JSON to one address.

    A server can send header after header, or one `100 Continue` after another, and every byte would begin a
    library's time-out anew. So the exchange runs in a thread, whose sockets are shut down when the time is over.

    Args:
        url: the address.
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

    def post(self, body: dict[str, Any]) -> tuple[int, bytes]:
        """Post a request; return the status, and the bytes of the answer where that is 200.

        Raises:
            ExchangeError: for a server that cannot be reached, is not trusted, is too slow or says too much.
        """
        given_up = threading.Event()
        outcome: list[tuple[int, bytes] | Exception] = []

        def work() -> None:
            try:
                outcome.append(self._post(body, given_up))
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

    def _post(self, body: dict[str, Any], given_up: threading.Event) -> tuple[int, bytes]:
        import httpx

        def trace(event: str, info: dict[str, Any]) -> None:
            if given_up.is_set():
                raise self._too_slow()
            if event.endswith(("connect_tcp.complete", "start_tls.complete")):
                opened = info["return_value"].get_extra_info("socket")
                self._sockets = [*(each for each in self._sockets if each.fileno() >= 0), opened]

        received = b""
        try:
            with self._client.stream("POST", self._url, json=body, extensions={"trace": trace}) as response:
                if response.status_code != 200:
                    return response.status_code, b""
                for piece in response.iter_raw():  # not unpacked: small bytes could become large ones
                    received += piece
                    if len(received) > self._most_bytes:
                        raise ExchangeError(f"answered with more than {self._most_bytes // 1024} KiB")
                return 200, received
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
    return "could not be reached" if "ConnectError" in kinds else f"could not be talked to ({kinds[0]})"
