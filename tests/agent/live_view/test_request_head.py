"""Every request is answered, also a malformed one, and with the status that says what is wrong with it."""

import socket

import pytest

from agent.live_view.access import Refusal
from agent.live_view.request_head import read_head

pytest.importorskip("websockets", reason="needs the extra `view`")

from agent.live_view.connection import MOST_CONNECTIONS

_HOST = b"Host: localhost\r\n"


def answered(server, request: bytes) -> tuple[int, dict[str, str], bytes]:
    """Send bytes on a connection of their own; return the status, the headers (names in small letters) and the body."""
    with socket.create_connection(("127.0.0.1", server.access.port), timeout=30) as connection:
        connection.sendall(request)
        answer = b""
        while piece := connection.recv(65536):
            answer += piece
    head, _, body = answer.partition(b"\r\n\r\n")
    first, *lines = head.decode().split("\r\n")
    pairs = [line.split(": ", 1) for line in lines]
    return int(first.split()[1]), {name.lower(): value for name, value in pairs}, body


@pytest.mark.parametrize(
    "target",
    [
        b"//[", b"/[", b"//[::1", b"/]", b"/%", b"/%zz", b"/%4", b"/?token=%", b"/?a=%g1", b"/#part", b"/a b", b"/\\",
        b"/|",
        b"/^", b"/`", b"/{}", b'/"', b"/<>", b"/\xc3\xa9", b"/\xff", b"/\x00", b"/\x07", b"*", b"", b"?", b"index.html",
        b"http://localhost/", b"http://[", b"https://evil.example/", b"file:///etc/passwd", b"localhost:80", b"/?[",
        b"/?\t",
    ],
)  # fmt: skip
def test_a_malformed_address_is_a_bad_request(watched, target):
    assert answered(watched, b"GET " + target + b" HTTP/1.1\r\n" + _HOST + b"\r\n")[0] == 400


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT", "PROPFIND", "get"])
@pytest.mark.parametrize("path", ["/", "/socket", "/nothing"])
@pytest.mark.parametrize("body", [b"", b"hello"])
def test_other_methods_are_not_allowed(watched, method, path, body):
    head = f"{method} {path} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {len(body)}\r\n\r\n"
    status, headers, _ = answered(watched, head.encode() + body)
    assert status == 405 and headers["allow"] == "GET, HEAD" and "default-src" in headers["content-security-policy"]


@pytest.mark.parametrize("path", ["/", "/live_view.js", "/nothing", "/socket"])
def test_head_has_the_headers_of_get_and_no_body(watched, path):
    got = answered(watched, f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
    asked = answered(watched, f"HEAD {path} HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n"
                              f"Connection: Upgrade\r\n\r\n".encode())  # fmt: skip
    assert got[:2] == asked[:2]
    assert asked[2] == b"" and len(got[2]) == int(got[1]["content-length"]) > 0


@pytest.mark.parametrize(
    ("head", "status"),
    [
        (b"", 400), (b"hello", 400), (b"GET /", 400), (b"GET / HTTP/1.1 x", 400), (b"GET  / HTTP/1.1", 400),
        (b"\x16\x03\x01\x02\x00\x01", 400), (b"GET / HTTP/2.0", 505), (b"GET / HTTP/0.9", 505),
        (b"GET / ICAP/1.0", 400),
        (b"GET / HTTP/1.1", 400), (b"GET / HTTP/1.0", 421), (b"GET / HTTP/1.1\r\nHost: localhost", 200),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\nHost: localhost", 400), (b"GET / HTTP/1.1\r\nHost: [", 400),
        (b"GET / HTTP/1.1\r\nHost: localhost:99999", 400), (b"GET / HTTP/1.1\r\nHost: a b", 400),
        (b"GET / HTTP/1.1\r\nHost: user@localhost", 400), (b"GET / HTTP/1.1\r\nHost: localhost/x", 400),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\nno colon", 400), (b"GET / HTTP/1.1\r\nHost: localhost\r\nA : b", 400),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\n folded", 400), (b"GET / HTTP/1.1\r\nHost: localhost\r\nA: b\x00", 400),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\nA: b\nC: d", 400), (b"GET / HTTP/1.1\r\nHost: localhost\r\n: b", 400),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: x", 400),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 7", 400),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked", 400),
        (b"GET /" + b"a" * 9000 + b" HTTP/1.1\r\nHost: localhost", 414), (b"GET / HTTP/1.1\r\nHost: evil.example", 421),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\n" + b"A: b\r\n" * 200 + b"B: c", 431),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\nA: " + b"b" * 40_000, 431),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\nCookie: \xff\xfe;;=;\r\nAccept: */*", 200),
        (b"GET /socket HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket", 400),
    ],
)  # fmt: skip
def test_a_malformed_head_is_answered(watched, head, status):
    assert answered(watched, head + b"\r\n\r\n")[0] == status


def test_a_head_may_come_byte_by_byte(watched):
    request = b"GET /live_view.css HTTP/1.1\r\n" + _HOST + b"\r\n"
    with socket.create_connection(("127.0.0.1", watched.access.port), timeout=30) as connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for place in range(len(request)):
            connection.sendall(request[place : place + 1])
        assert connection.recv(100).startswith(b"HTTP/1.1 200 OK\r\n")


def test_only_so_many_connections_are_taken(watched):
    """Clients that say nothing take the places; one more is told so,
    and the server is there again when they have left.
    """
    address = ("127.0.0.1", watched.access.port)
    silent = [socket.create_connection(address, timeout=30) for _ in range(MOST_CONNECTIONS)]
    try:
        assert answered(watched, b"")[0] == 503
    finally:
        for connection in silent:
            connection.close()
    while (status := answered(watched, b"GET / HTTP/1.1\r\n" + _HOST + b"\r\n")[0]) == 503:
        pass
    assert status == 200


def test_any_bytes_are_a_head_or_are_refused():
    """No bytes lead to an error; whatever is taken is one GET on a path."""
    import random

    generator = random.Random(0)
    pieces = [
        b"GET",
        b"HEAD",
        b" ",
        b"/",
        b"%41",
        b"%",
        b"?",
        b"HTTP/1.1",
        b"\r\n",
        b"Host: localhost",
        b":",
        b"\xff",
        b"[",
    ]
    taken = 0
    for _ in range(20_000):
        raw = b"".join(generator.choices(pieces, k=generator.randrange(1, 12)))
        if generator.random() < 0.5:
            raw = b"GET /" + raw.replace(b"\r\n", b"") + b" HTTP/1.1\r\nHost: localhost"
        head = read_head(raw + b"\r\n\r\n")
        if not isinstance(head, Refusal):
            taken += 1
            assert head.raw.startswith(b"GET /") and head.raw.endswith(b"\r\n\r\n")
    assert taken > 100
