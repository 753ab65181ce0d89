"""Check the head of a request before anything else reads it: its line, its target and its headers.

Only the origin form of a target is taken, "/path?query" (RFC 9112, 3.2.1): the page asks for nothing else.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from http import HTTPStatus

from agent.live_view.access import Refusal

END = b"\r\n\r\n"
LONGEST = 32_768  # bytes of a head
_LONGEST_TARGET, _MOST_HEADERS = 8000, 100
METHODS = ("GET", "HEAD")
_LINE = re.compile(rb"([!#$%&'*+.^_`|~0-9A-Za-z-]+) ([^ ]+) HTTP/(\d)\.(\d)")
_SIGN = r"[A-Za-z0-9._~!$&'()*+,;=:@/-]|%[0-9A-Fa-f]{2}"
_TARGET = re.compile(rf"/(?:{_SIGN})*(?:\?(?:{_SIGN}|\?)*)?")
_HEADER = re.compile(rb"([!#$%&'*+.^_`|~0-9A-Za-z-]+):[ \t]*([\t\x20-\x7e\x80-\xff]*?)[ \t]*")
_HOST = re.compile(r"(?:\[[0-9A-Fa-f:.]+\]|(?:[A-Za-z0-9._~!$&'()*+,;=-]|%[0-9A-Fa-f]{2})*)(?::\d{0,5})?")
_ONCE = ("host", "origin", "cookie", "connection", "content-length")


@dataclass(frozen=True)
class Head:
    """A head that is as it should be.

    Attributes:
        method: of `METHODS`.
        raw: its bytes, with GET as the method: HEAD differs in the answer alone.
    """

    method: str
    raw: bytes


def read_head(raw: bytes) -> Head | Refusal:
    """Return the head of a request, or why it is refused.

    Args:
        raw: the bytes up to and with the empty line.
    """
    first, *lines = raw.removesuffix(END).split(b"\r\n")
    found = _LINE.fullmatch(first)
    if found is None:
        return Refusal(400, "this is not a request of HTTP")
    method, target, version = found[1].decode(), found[2].decode("latin-1"), found[3]
    if version != b"1":
        return Refusal(505, "only HTTP/1.0 and HTTP/1.1 are supported")
    if method not in METHODS:
        return Refusal(405, f"only {' and '.join(METHODS)} are answered")
    if len(target) > _LONGEST_TARGET:
        return Refusal(414, f"an address has at most {_LONGEST_TARGET} characters")
    if not _TARGET.fullmatch(target):
        return Refusal(400, "the address is malformed; legal: a path that begins with /, and a query")
    refusal = _refused_headers(lines, needs_host=found[4] != b"0")
    return refusal or Head(method, b"GET" + raw[len(method) :])


def _refused_headers(lines: list[bytes], needs_host: bool) -> Refusal | None:
    """Return why the lines of headers are refused; `None` if they are not."""
    if len(lines) > _MOST_HEADERS:
        return Refusal(431, f"a request has at most {_MOST_HEADERS} headers")
    values: dict[str, str] = {}
    for line in lines:
        found = _HEADER.fullmatch(line)
        if found is None:
            return Refusal(400, "a header is malformed; legal: NAME: VALUE")
        name = found[1].decode().lower()
        if name in values and name in _ONCE:
            return Refusal(400, "a header is given twice")
        values[name] = found[2].decode("latin-1")
    if needs_host and "host" not in values:
        return Refusal(400, "the header Host is missing")
    if not _is_host(values.get("host", "")):
        return Refusal(400, "the header Host is malformed")
    if values.get("content-length", "0") != "0" or "transfer-encoding" in values:
        return Refusal(400, "a request here has no body")
    return None


def _is_host(host: str) -> bool:
    return bool(_HOST.fullmatch(host)) and int(host.rpartition("]")[2].partition(":")[2] or 0) < 2**16


def refusal_bytes(refusal: Refusal, headers: Mapping[str, str]) -> bytes:
    """Return the whole answer to a request that is refused before it is read.

    Args:
        refusal: why.
        headers: those of every answer.
    """
    body = f"{refusal.reason}\n".encode()
    allow = {"Allow": ", ".join(METHODS)} if refusal.status == 405 else {}
    lines = {**headers, **allow, "Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body))}
    lines["Connection"] = "close"
    head = f"HTTP/1.1 {refusal.status} {HTTPStatus(refusal.status).phrase}\r\n"
    return (head + "".join(f"{name}: {value}\r\n" for name, value in lines.items()) + "\r\n").encode() + body
