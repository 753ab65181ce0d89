"""Decide which requests the live view answers: by the token, the name of the host and the origin of the page."""

from __future__ import annotations

import hmac
import ipaddress
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

LOOPBACK = "127.0.0.1"
_TOKEN_BYTES = 24
_LOCAL_NAMES = ("localhost",)


@dataclass(frozen=True)
class Refusal:
    """A request that is refused: the HTTP status and the reason in a sentence."""

    status: int
    reason: str


@dataclass(frozen=True)
class Access:
    """The rules for requests to a live view.

    Attributes:
        host: the address that the view listens on.
        port: its port, which names the cookie: browsers send a cookie to every port of a host.
        token: what a request has to show, or `None` if every program of this machine may connect.
    """

    host: str
    port: int
    token: str | None

    @property
    def cookie(self) -> str:
        """Return the name of the cookie with the token."""
        return f"structagent_{self.port}"

    @property
    def address(self) -> str:
        """Return the address of the page, with the token if one is needed."""
        host = LOOPBACK if is_any_address(self.host) else self.host
        shown = f"[{host}]" if ":" in host else host
        return f"http://{shown}:{self.port}/" + (f"?token={self.token}" if self.token else "")

    def refusal(self, path: str, headers: Mapping[str, str]) -> Refusal | None:
        """Return why a request is refused; `None` if it is answered.

        Args:
            path: the target of the request with its query.
            headers: its headers; names in any case.
        """
        if self.token is not None and not self._shows_token(path, headers):
            return Refusal(403, "this address needs its token: open the address that structagent printed")
        host = headers.get("Host", "")
        if self.token is None and not is_loopback(_host_name(host)):
            # A foreign page whose name was pointed at this machine would otherwise be let in.
            return Refusal(421, "without a token, only names of this machine are answered: localhost or 127.0.0.1")
        origin = headers.get("Origin")
        if origin is not None and _place(origin) != host.lower():
            return Refusal(403, "pages of other origins are not answered")
        return None

    def has_token_in(self, path: str) -> bool:
        """Return whether the query of a request has the right token."""
        given = parse_qs(path.partition("?")[2]).get("token", [""])[0]
        return self.token is not None and _same(given, self.token)

    def _shows_token(self, path: str, headers: Mapping[str, str]) -> bool:
        return self.has_token_in(path) or _same(_cookie(headers.get("Cookie", ""), self.cookie), self.token or "")


def new_token() -> str:
    """Return a token that nobody can guess."""
    return secrets.token_urlsafe(_TOKEN_BYTES)


def is_loopback(host: str) -> bool:
    """Return whether a name or an address is this machine's own, which no other machine can reach."""
    if host.lower() in _LOCAL_NAMES:
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def is_any_address(host: str) -> bool:
    """Return whether an address stands for all addresses of this machine."""
    try:
        return ipaddress.ip_address(host).is_unspecified
    except ValueError:
        return False


def _host_name(host: str) -> str:
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _place(origin: str) -> str | None:
    """Return the host and port of an origin; `None` if it has none."""
    try:
        return urlsplit(origin).netloc.lower() or None
    except ValueError:
        return None


def _cookie(header: str, name: str) -> str:
    try:
        found = SimpleCookie(header).get(name)
    except CookieError:
        return ""
    return "" if found is None else found.value


def _same(given: str, token: str) -> bool:
    """Compare in a time that does not depend on where they differ."""
    return bool(token) and hmac.compare_digest(given.encode("utf-8", "surrogatepass"), token.encode())
