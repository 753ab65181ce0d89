"""The real server: what it answers, to whom, and how its pages share one driver."""

import gc
import json
import socket
import sys
import threading
import time

import pytest

from agent.errors import UsageError
from agent.live_view.server import LONGEST_MESSAGE, MOST_VIEWERS, ViewServer, server_beside
from tests.agent.live_view.conftest import Client, address_of, get

exceptions = pytest.importorskip("websockets.exceptions", reason="needs the extra `view`")
ConnectionClosed, InvalidStatus = exceptions.ConnectionClosed, exceptions.InvalidStatus


@pytest.fixture
def asked():
    return []


@pytest.fixture
def driven(asked):
    """A server with one action, which notes its messages and refuses those that say so."""

    def take(message):
        asked.append(message)
        return message.get("refuse", "")

    with ViewServer("127.0.0.1", 0, actions={"line": take}) as server:
        yield server


@pytest.fixture
def guarded(asked):
    with ViewServer(
        "127.0.0.1", 0, token=True, actions={"line": lambda message: asked.append(message) or ""}
    ) as server:
        yield server


# --- what is served ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "kind"),
    [("/", "text/html"), ("/live_view.js", "text/javascript"), ("/scene_3d.js", "text/javascript"),
     ("/matrices.js", "text/javascript"), ("/live_view.css", "text/css")],
)  # fmt: skip
def test_the_files_of_the_page_are_served_with_strict_headers(watched, path, kind):
    status, headers, body = get(address_of(watched, path))
    assert status == 200 and headers["Content-Type"].startswith(kind) and len(body) > 200
    assert (
        "default-src 'none'" in headers["Content-Security-Policy"]
        and "unsafe" not in headers["Content-Security-Policy"]
    )
    assert headers["X-Content-Type-Options"] == "nosniff" and headers["Cache-Control"] == "no-store"


@pytest.mark.parametrize(
    "path", ["/nothing", "/../access.py", "/page/index.html", "//etc/passwd", "/%2e%2e/server.py", "/socket"]
)
def test_nothing_else_is_served(watched, path):
    assert get(address_of(watched, path))[0] == 404


def test_a_page_loads_nothing_from_elsewhere(watched):
    for path in ("/", "/live_view.js", "/scene_3d.js", "/live_view.css"):
        body = get(address_of(watched, path))[2].decode()
        assert "http://" not in body and "https://" not in body and "//cdn" not in body


# --- who is answered ---------------------------------------------------------------------------


@pytest.mark.parametrize("path", ["/", "/live_view.js", "/live_view.css", "/nothing", "/socket"])
@pytest.mark.parametrize("query", ["", "?token=wrong"])
def test_without_the_token_nothing_is_answered(guarded, path, query):
    status, headers, body = get(address_of(guarded, path + query))
    assert status == 403 and b"token" in body and len(body) < 200 and "Set-Cookie" not in headers


@pytest.mark.parametrize("query", ["", "?token=wrong", "?token="])
def test_without_the_token_there_is_no_websocket(guarded, join, query):
    with pytest.raises(InvalidStatus) as refused:
        join(guarded, query)
    assert refused.value.response.status_code == 403
    assert not guarded.watched


def test_the_printed_address_becomes_a_cookie_with_which_all_is_answered(guarded, join, asked):
    port, token = guarded.access.port, guarded.access.token
    status, headers, body = get(guarded.access.address)
    assert (status, headers["Location"], body) == (303, "/", b"")
    cookie = headers["Set-Cookie"]
    assert "HttpOnly" in cookie and "SameSite=Lax" in cookie
    shown = cookie.partition(";")[0]
    assert shown == f"structagent_{port}={token}"
    assert get(address_of(guarded), Cookie=shown)[0] == 200
    page = join(guarded, additional_headers={"Cookie": shown})
    page.until("roles")
    page.send(kind="line", line="hello")
    wait_for(lambda: asked)
    assert token not in get(address_of(guarded), Cookie=shown)[2].decode()


def test_an_address_that_others_can_reach_always_has_a_token():
    with ViewServer("0.0.0.0", 0) as server:
        assert server.access.token is not None
        assert get(address_of(server))[0] == 403
        assert get(server.access.address)[0] == 303


def test_pages_of_other_origins_get_no_websocket(driven, join):
    with pytest.raises(InvalidStatus) as refused:
        join(driven, origin="http://evil.example")
    assert refused.value.response.status_code == 403
    join(driven, origin=address_of(driven).rstrip("/")).until("roles")


def test_a_foreign_name_of_this_machine_is_not_answered(driven):
    assert get(address_of(driven), Host="evil.example")[0] == 421


def test_a_header_that_is_given_twice_is_refused(driven):
    with socket.create_connection(("127.0.0.1", driven.access.port), timeout=10) as connection:
        connection.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n")
        assert connection.recv(100).startswith(b"HTTP/1.1 400")


def test_there_is_a_most_of_viewers(driven, join):
    for _ in range(MOST_VIEWERS):
        join(driven).until("roles")
    with pytest.raises(InvalidStatus) as refused:
        join(driven)
    assert refused.value.response.status_code == 503


# --- one driver --------------------------------------------------------------------------------


def test_only_the_driver_is_obeyed_and_taking_over_is_explicit(driven, join, asked):
    first, second = join(driven), join(driven)
    assert first.until(lambda message: message.get("viewers") == 2)["driver"] == "you"
    assert second.until("roles")["driver"] == "other"
    second.send(kind="line", line="from the second")
    assert second.until("refused")["reason"] == "this page watches; take over to drive"
    assert asked == []
    second.send(kind="take_over")
    assert second.until("roles")["driver"] == "you"
    assert first.until("roles")["driver"] == "other"
    second.send(kind="line", line="from the second")
    first.send(kind="line", line="from the first")
    assert first.until("refused")
    assert [message["line"] for message in asked] == ["from the second"]


def test_when_the_driver_leaves_nobody_drives_until_someone_asks(driven, join):
    first, second = join(driven), join(driven)
    second.until("roles")
    first.close()
    assert second.until(lambda message: message.get("viewers") == 1)["driver"] == "nobody"


def test_beside_a_terminal_pages_only_watch(watched, join):
    page = join(watched)
    assert page.until("roles")["driver"] == "terminal"
    for kind in ("take_over", "line", "stop"):
        page.send(kind=kind)
        assert page.until("refused")["reason"] == f"this view has no {kind!r}"


def test_the_reason_of_a_refusal_reaches_the_page_that_asked(driven, join):
    first, second = join(driven), join(driven)
    first.send(kind="line", refuse="not now")
    assert first.until("refused")["reason"] == "not now"
    second.until("roles")
    assert second.of("refused") == []


@pytest.mark.parametrize(
    "hostile",
    ["", "{", "[]", "null", "7", '"line"', "{}", '{"kind": null}', '{"kind": ["line"]}', '{"kind": "__class__"}',
     b"\xff\xfe", b"{}", "[" * 8000, '{"kind": "' + "x" * 8000 + '"}'],
)  # fmt: skip
def test_hostile_messages_are_refused_and_the_page_stays(driven, join, asked, hostile):
    page = join(driven)
    page.socket.send(hostile)
    assert len(page.until("refused")["reason"]) < 100
    page.send(kind="line", line="still here")
    wait_for(lambda: asked)


def test_a_message_that_is_too_long_ends_the_connection(driven, join, asked):
    page = join(driven)
    page.send(kind="line", line="x" * LONGEST_MESSAGE)
    with pytest.raises(ConnectionClosed):
        page.until("refused")
    join(driven).until("roles")
    assert asked == []


# --- messages ----------------------------------------------------------------------------------


def test_pages_that_come_later_get_the_state(watched, join):
    watched.publish("scene", {"scene": 1})
    watched.publish("entry", {"type": "line", "text": "hello", "style": ""})
    page = join(watched)
    page.until("scene")
    assert page.text == "hello"


def test_the_end_is_told(join):
    server = ViewServer("127.0.0.1", 0)
    page = join(server)
    page.until("roles")
    server.close()
    with pytest.raises(ConnectionClosed) as closed:
        page.until("nothing")
    assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1001, "structagent has ended")
    server.publish("entry", {"type": "line", "text": "", "style": ""})  # nobody is there any more
    assert not any(thread.name == "live view" and thread.is_alive() for thread in threading.enumerate())


def test_many_messages_and_viewers_leave_nothing_behind(watched):
    payload = {"values": list(range(1000))}

    def round_of(number: int) -> int:
        page = Client(watched)
        for _ in range(100):
            watched.publish("poses", payload)
        watched.publish("end", {"round": number})
        page.until(lambda message: message.get("round") == number)
        page.close()
        del page
        wait_for(lambda: not watched.watched)
        gc.collect()
        return len(gc.get_objects())

    round_of(0)
    first = round_of(1)
    for number in range(2, 7):
        last = round_of(number)
    assert last < first + 300, "a message that is kept has 1000 numbers"


# --- what goes wrong ---------------------------------------------------------------------------


def test_a_port_in_use_is_named_and_the_view_beside_a_command_takes_another(watched):
    port = watched.access.port
    with pytest.raises(UsageError, match=f"port {port} of 127.0.0.1 is in use by another program; --port 0 takes"):
        ViewServer("127.0.0.1", port)
    with server_beside(port) as other:
        assert other.access.port != port


def test_an_address_of_another_machine_is_named():
    with pytest.raises(UsageError, match="cannot listen on 192.0.2.7, port 0: "):
        ViewServer("192.0.2.7", 0)


def test_without_the_package_one_sentence_names_the_command(monkeypatch):
    for module in [name for name in sys.modules if name.partition(".")[0] == "websockets"]:
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(UsageError) as missing:
        ViewServer("127.0.0.1", 0)
    assert str(missing.value) == "the live view needs the package websockets: pip install 'structagent[view]'"


def wait_for(condition, seconds: float = 10.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_messages_are_json_of_their_kind(watched, join):
    page = join(watched)
    watched.publish("picture", {"caption": "a\u2028b"})
    assert page.until("picture") == json.loads('{"kind": "picture", "caption": "a\\u2028b"}')
