"""Which requests are answered: by token, host and origin."""

import pytest

from agent.live_view.access import Access, is_loopback, new_token

TOKEN = "a-token-of-the-test"
LOCAL, GUARDED = Access("127.0.0.1", 8642, None), Access("0.0.0.0", 8642, TOKEN)


def status(access, path="/", **headers) -> int:
    refusal = access.refusal(path, {name.title(): value for name, value in headers.items()})
    return 200 if refusal is None else refusal.status


@pytest.mark.parametrize("host", ["localhost:8642", "127.0.0.1:8642", "[::1]:8642", "localhost:9000", "127.0.0.1"])
def test_without_a_token_names_of_this_machine_are_answered(host):
    assert status(LOCAL, host=host) == 200


@pytest.mark.parametrize(
    "host", ["evil.example:8642", "192.168.0.7:8642", "", "localhost.evil.example", "[", "127.0.0.1.nip.io"]
)
def test_without_a_token_other_names_are_not_answered(host):
    assert status(LOCAL, host=host) == 421


@pytest.mark.parametrize(
    ("origin", "expected"),
    [
        ("http://localhost:8642", 200), ("https://localhost:8642", 200), ("http://localhost:9000", 403),
        ("http://evil.example", 403), ("http://[", 403), ("null", 403), ("", 403),
        ("http://localhost:8642.evil.example", 403),
    ],
)  # fmt: skip
def test_pages_of_other_origins_are_not_answered(origin, expected):
    assert status(LOCAL, host="localhost:8642", origin=origin) == expected
    assert status(GUARDED, f"/socket?token={TOKEN}", host="localhost:8642", origin=origin) == expected


@pytest.mark.parametrize("path", ["/", "/socket", "/live_view.js", "/nothing"])
@pytest.mark.parametrize(
    "given", ["", "?token=", "?token=wrong", f"?token={TOKEN[:-1]}", f"?token={TOKEN}x", "?token=\udcff"]
)
def test_a_wrong_or_missing_token_is_refused(path, given):
    assert status(GUARDED, path + given, host="robot:8642") == 403


def test_a_token_in_the_address_or_in_the_cookie_of_this_port_is_taken():
    assert status(GUARDED, f"/?token={TOKEN}", host="robot:8642") == 200
    assert status(GUARDED, "/", host="robot:8642", cookie=f"a=b; structagent_8642={TOKEN}") == 200
    assert status(GUARDED, "/", host="robot:8642", cookie=f"structagent_8643={TOKEN}") == 403
    assert status(GUARDED, "/", host="robot:8642", cookie="structagent_8642=wrong") == 403
    assert status(GUARDED, "/", host="robot:8642", cookie="\x00;;=;") == 403


def test_without_a_token_there_is_none_that_could_be_shown():
    assert not LOCAL.has_token_in("/?token=") and not LOCAL.has_token_in("/?token=None")


def test_tokens_are_long_and_never_the_same():
    tokens = {new_token() for _ in range(50)}
    assert len(tokens) == 50 and min(map(len, tokens)) >= 32


@pytest.mark.parametrize(
    ("host", "local"),
    [("127.0.0.1", True), ("127.1.2.3", True), ("::1", True), ("LocalHost", True), ("0.0.0.0", False), ("::", False),
     ("10.0.0.1", False), ("robot", False), ("", False)],
)  # fmt: skip
def test_only_addresses_of_this_machine_need_no_token(host, local):
    assert is_loopback(host) is local


def test_the_address_of_the_page():
    assert LOCAL.address == "http://127.0.0.1:8642/"
    assert GUARDED.address == f"http://127.0.0.1:8642/?token={TOKEN}"
    assert Access("::1", 1, None).address == "http://[::1]:1/"
