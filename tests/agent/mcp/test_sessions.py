"""Sessions over HTTP: abandoned ones give way, the one idle for longest first, and none that is at work is taken."""

import anyio
import httpx
import pytest

pytest.importorskip("mcp", reason="needs the extra mcp")

from mcp import Client

from agent.mcp.server import MOST_SESSIONS
from agent.mcp.sessions import Sessions
from tests.agent.mcp.conftest import Person, plan, refusal
from tests.agent.mcp.test_transports import over_http

_ACCEPTS = {"accept": "application/json, text/event-stream", "content-type": "application/json"}
_HELLO = {
    "jsonrpc": "2.0",
    "id": 1,
    "method": "initialize",
    "params": {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "lost", "version": "1"}},
}


async def opened(web: httpx.AsyncClient, url: str, **headers: str) -> httpx.Response:
    """Open a session as a client does that will never be heard of again."""
    return await web.post(url, json=_HELLO, headers=_ACCEPTS | headers)


async def status_of(web: httpx.AsyncClient, url: str, session: str) -> int:
    """Return what a session's ping is answered with."""
    ping = {"jsonrpc": "2.0", "id": 2, "method": "ping"}
    return (await web.post(url, json=ping, headers=_ACCEPTS | {"mcp-session-id": session})).status_code


def talking(served, conversation) -> None:
    async def talk(url: str) -> None:
        with anyio.fail_after(300):
            async with httpx.AsyncClient(trust_env=False) as web:
                await conversation(web, url)

    with over_http(served) as (url, _):
        anyio.run(talk, url)


def test_abandoned_sessions_give_way(served):
    async def conversation(web, url):
        answers = [await opened(web, url) for _ in range(MOST_SESSIONS)]
        sessions = [answer.headers["mcp-session-id"] for answer in answers]
        assert await status_of(web, url, sessions[0]) == 200  # used again: the second is idle for longest now
        assert [(await opened(web, url)).status_code for _ in range(3)] == [200] * 3
        found = [await status_of(web, url, session) for session in sessions[:6]]
        assert found == [200, 404, 404, 404, 200, 200]
        assert {(await opened(web, url)).status_code for _ in range(2 * MOST_SESSIONS)} == {200}

    talking(served, conversation)


def test_a_session_at_work_is_not_taken(served):
    """While a person is asked, more clients come than there may be sessions."""

    async def conversation(web, url):
        class Slow(Person):
            async def __call__(self, context, params):
                assert {(await opened(web, url)).status_code for _ in range(2 * MOST_SESSIONS)} == {200}
                return await super().__call__(context, params)

        person = Slow("decline")
        async with Client(url, mode="legacy", elicitation_callback=person) as client:
            sentence = await refusal(client, "build", plan_id=await plan(client, "stack the boxes"))
            assert sentence == "nothing was moved: the person declined build; ask what should be different"

    talking(served, conversation)


def test_pages_that_are_not_let_in_end_no_session(served):
    async def conversation(web, url):
        sessions = [(await opened(web, url)).headers["mcp-session-id"] for _ in range(MOST_SESSIONS)]
        assert (await opened(web, url, origin="https://evil.example")).status_code in (403, 503)
        assert (await opened(web, url, host="evil.example")).status_code in (421, 503)
        assert [await status_of(web, url, session) for session in sessions] == [200] * MOST_SESSIONS

    talking(served, conversation)


def test_a_client_that_waits_for_messages_gives_way_last():
    """Two sessions, of which the older one has an open stream; then a tool that outlives its client's request."""
    sessions, ended, now = Sessions(2, lambda: now[0]), [], [0.0]
    numbers = iter("abcdef")
    hold = anyio.Event

    async def app(scope, receive, send):
        headers = dict(scope["headers"])
        if scope["method"] == "DELETE":
            ended.append(headers[b"mcp-session-id"].decode())
        if scope["method"] == "GET":
            await scope["hold"].wait()
        name = headers.get(b"mcp-session-id") or next(numbers).encode()
        await send({"type": "http.response.start", "status": 200, "headers": [(b"mcp-session-id", name)]})

    async def call(method: str, name: str = "", **more) -> None:
        async def ignore(message) -> None:
            """Take the answer."""

        now[0] += 1.0
        headers = [(b"mcp-session-id", name.encode())] if name else []
        await sessions.giving_way(app)({"type": "http", "method": method, "headers": headers, **more}, None, ignore)

    async def talk() -> None:
        await call("POST")
        await call("POST")
        async with anyio.create_task_group() as group:
            event = hold()

            async def stream() -> None:
                await call("GET", "a", hold=event)

            group.start_soon(stream)
            await anyio.wait_all_tasks_blocked()
            await call("POST")
            assert ended == ["b"]
            event.set()
        with sessions.working("a"):
            await call("POST")
            assert ended == ["b", "c"]
            with sessions.working("d"):
                await call("POST")  # nobody can be taken: the server itself refuses one too many
                assert ended == ["b", "c"]

    anyio.run(talk)
