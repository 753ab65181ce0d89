"""A whole conversation with the official client over both transports, and who is not let in."""

import json
import os
import signal
import subprocess
import threading
from contextlib import contextmanager

import anyio
import httpx
import pytest

pytest.importorskip("mcp", reason="needs the extra mcp")

from mcp import Client, MCPError, StdioServerParameters
from mcp.client.streamable_http import streamable_http_client

from agent.arm.controller import ArmDriver
from agent.errors import INTERRUPTED, BadInput, UsageError
from tests.agent.chat.conftest import DESK
from tests.agent.mcp.conftest import QUICK, Person, data, plan, refusal
from tests.commands import structagent

TOKEN = "a-token-of-enough-characters"
SCHEMAS = ("objects", "status", "status", "status", "stands", "success", "outcome", "stopped", "moved", "page")


async def whole_conversation(client, person: Person) -> None:
    """Look, parse, propose, preview, refuse, build with approval, report, undo."""
    tools = {tool.name: tool for tool in (await client.list_tools()).tools}
    assert [*tools] == [
        "look", "parse", "propose", "propose_again", "preview", "build", "say", "stop", "undo", "report"
    ]  # fmt: skip
    for tool, field in zip(tools.values(), SCHEMAS, strict=True):
        assert field in tool.output_schema["properties"] and tool.input_schema["additionalProperties"] is False
        assert tool.description and tool.annotations.destructive_hint == (tool.name in ("build", "say", "undo"))

    seen = await client.call_tool("look")
    assert [one["name"] for one in seen.structured_content["objects"]][-1] == "orange"
    assert seen.content[1].type == "image" and seen.content[1].mime_type == "image/webp"
    read = await data(client, "parse", text="stack the boxes on the left")
    assert read["status"] == "ok" and read["parts"] == ['tower of "box 1", "box 2", left']
    assert "dragon" in await refusal(client, "propose", text="put the dragons in a line")
    plan_id = await plan(client)
    assert (await data(client, "preview", plan_id=plan_id))["stands"] and not person.asked

    steps = []

    async def progress(number, total, message):
        steps.append((number, message))

    built = await client.call_tool("build", {"plan_id": plan_id}, progress_callback=progress)
    assert built.structured_content["success"] and built.structured_content["moved"] == ["orange"]
    assert len(person.asked) == 1 and "orange" in person.asked[0]
    assert [number for number, _ in steps] == [*range(1, len(steps) + 1)]
    assert any(message.startswith('picked "orange"') for _, message in steps)

    report = await data(client, "report")
    assert report["success"] and report["instruction"] == QUICK and os.path.getsize(report["page"]) > 10_000
    for uri in report["resources"]:
        (content,) = (await client.read_resource(uri)).contents
        assert getattr(content, "text", None) or content.blob, uri
    scene = json.loads((await client.read_resource("structagent://scene")).contents[0].text)
    assert scene["asked"] == '"orange" left of "box 1"'
    with pytest.raises(MCPError, match='has no picture "x"; legal: camera-before, '):
        await client.read_resource(f"structagent://turns/{report['turn']}/pictures/x")
    assert (await data(client, "undo"))["moved"] == ["orange"]


def test_over_standard_input_and_output(tmp_path):
    options = ("--scene", str(DESK), "--model", "geometric", "--hold", "weld", "--out", str(tmp_path / "out"))
    command, *arguments = structagent("mcp", *options)
    server = StdioServerParameters(command=command, args=arguments, cwd=tmp_path)
    person = Person()

    async def talk() -> None:
        with anyio.fail_after(500):
            async with Client(server, elicitation_callback=person) as client:
                assert client.server_info.name == "structagent"
                await whole_conversation(client, person)

    anyio.run(talk)
    lines = [json.loads(line) for line in (tmp_path / "out" / "audit.jsonl").read_text().splitlines()]
    builds = [(line["decision"], line["outcome"]) for line in lines if line["tool"] == "build"]
    assert builds == [("asked", "asked"), ("approved", "started"), ("approved", "done")]
    assert lines[0]["client"].startswith("mcp ")


@contextmanager
def over_http(served, **address):
    """Serve on a port that is free; gives the URL and what was said."""
    from agent.mcp.serving import Address, http_server

    said = []
    web, listening = http_server(served.server, Address(port=0, **address), said.append)
    thread = threading.Thread(target=lambda: anyio.run(lambda: web.serve(sockets=[listening])))
    thread.start()
    try:
        yield f"http://127.0.0.1:{listening.getsockname()[1]}/mcp", said
    finally:
        web.should_exit = True
        thread.join()


def test_over_http(served):
    person = Person()

    async def talk(url: str) -> None:
        with anyio.fail_after(500):
            async with Client(url, mode="legacy", elicitation_callback=person) as client:
                await whole_conversation(client, person)

    with over_http(served) as (url, said):
        anyio.run(talk, url)
    assert said == [f"serving on {url}"]


def test_a_client_that_is_lost_stops_its_build_over_http(served, monkeypatch):
    halts, person = [], Person()
    halt = ArmDriver.halt
    monkeypatch.setattr(ArmDriver, "halt", lambda driver: halts.append(halt(driver)))

    async def talk(url: str) -> None:
        picked = anyio.Event()

        async def progress(number, total, message):
            if message.startswith('picked "orange"'):
                picked.set()

        async def build(client, plan_id: str) -> None:
            await client.call_tool("build", {"plan_id": plan_id}, progress_callback=progress)

        with anyio.fail_after(500):
            async with anyio.create_task_group() as group:
                async with Client(url, elicitation_callback=person) as client:
                    group.start_soon(build, client, await plan(client))
                    await picked.wait()
                    group.cancel_scope.cancel()
            while served.worker.job is not None:
                await anyio.sleep(0.05)

    with over_http(served) as (url, _):
        anyio.run(talk, url)
    assert halts and [line["outcome"] for line in served.audit][-1] == "cancelled"


def test_ctrl_c_ends_a_server_that_waits_for_its_client(tmp_path):
    command = structagent("mcp", "--scene", str(DESK), "--out", str(tmp_path / "out"))
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert any(b"serving on standard input and output" in line for line in process.stderr)
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == INTERRUPTED
        assert process.stdout.read() == b"" and process.stderr.read() == b"structagent: interrupted\n"


def posted(url: str, **headers: str) -> int:
    """Return the status of a request with these headers."""
    accept = {"accept": "application/json, text/event-stream", "content-type": "application/json"}
    body = {"jsonrpc": "2.0", "id": 1, "method": "ping"}
    return httpx.post(url, json=body, headers=accept | headers, trust_env=False).status_code


def test_other_hosts_and_pages_are_refused(served):
    with over_http(served, allowed=("robot.example",)) as (url, _):
        port = url.split(":")[2].removesuffix("/mcp")
        assert posted(url, host="evil.example") == posted(url, host=f"evil.example:{port}") == 421
        assert posted(url, host=f"127.0.0.1.evil.example:{port}") == 421
        assert posted(url, origin="https://evil.example") == posted(url, origin="null") == 403
        allowed = {
            posted(url),
            posted(url, host=f"robot.example:{port}"),
            posted(url, origin=f"http://localhost:{port}"),
        }
        assert not allowed & {401, 403, 421}


def test_a_token_is_required_where_there_is_one(served):
    async def talk(url: str) -> None:
        async with httpx.AsyncClient(headers={"authorization": f"bearer {TOKEN}"}, trust_env=False) as web:
            async with Client(streamable_http_client(url, http_client=web)) as client:
                assert (await client.list_tools()).tools

    with over_http(served, token=TOKEN) as (url, said):
        for value in ("", TOKEN, "Bearer", f"Bearer {TOKEN}x", f"bearer {TOKEN[:-1]}", f"Basic {TOKEN}"):
            assert posted(url, authorization=value) == 401
        assert posted(url) == 401
        anyio.run(talk, url)
    assert TOKEN not in "".join(said)


def test_other_machines_need_a_token_that_is_printed_if_it_was_made(served):
    with over_http(served, host="0.0.0.0") as (url, said):
        token = said[1].removeprefix("clients need the header Authorization: ")
        assert token.startswith("Bearer ") and len(token) > 40
        assert posted(url) == 401 and posted(url, authorization=token) not in (401, 403, 421)


@pytest.mark.parametrize(
    ("address", "error", "words"),
    [
        ({"token": "short"}, UsageError, "STRUCTAGENT_MCP_TOKEN must have 16 characters or more, but it has 5"),
        ({"host": "192.0.2.1"}, BadInput, "cannot listen on 192.0.2.1:0: "),
    ],
)
def test_an_address_that_cannot_be_served(served, address, error, words):
    with pytest.raises(error, match=words), over_http(served, **address):
        pass


def test_broken_requests_are_refused_and_the_server_stays(served):
    json_and_stream = {"accept": "application/json, text/event-stream", "content-type": "application/json"}
    modern = json_and_stream | {"mcp-protocol-version": "2026-07-28"}
    bodies = (
        b"", b"{", b"[" * 5000, b"null", b"[]", b'{"jsonrpc": "2.0"}', b"\xff\xfe", b'{"a": 1e999}',
        b'{"jsonrpc": "2.0", "id": 1, "method": "tools/call", "params": {"name": "build", "arguments": 7}}',
    )  # fmt: skip
    with over_http(served) as (url, _), httpx.Client(trust_env=False) as web:
        for headers in (json_and_stream, modern):
            assert {web.post(url, content=body, headers=headers).status_code // 100 for body in bodies} == {4}
            assert web.post(url, content=b"x" * 300_000, headers=headers).status_code == 413
        assert web.get(f"{url}/../../etc/passwd").status_code == 404

        async def talk() -> None:
            async with Client(url) as client:
                assert len((await data(client, "look"))["objects"]) == 6

        anyio.run(talk)
