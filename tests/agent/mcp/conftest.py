"""A small table served in this process, with a quick arm and small pictures, to clients of the official package."""

import json
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import anyio
import numpy as np
import pytest

from agent.errors import UsageError
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from agent.runtime.stdio import import_pybullet_silently
from tests.agent.chat.conftest import DESK, few_candidates, quick_arm, small_pictures  # noqa: F401

OPTIONS = RunOptions(str(DESK), model="geometric", hold="weld")  # as the chat's tests do
QUICK = "put the orange to the left of box 1"  # the arm moves one object


class Person:
    """A person who answers every question of the server in the same way.

    Attributes:
        asked: the questions.
    """

    def __init__(self, action: str = "accept", content: object = None) -> None:
        self.asked: list[str] = []
        self._action, self._content = action, {"approve": True} if content is None else content

    async def __call__(self, context, params):
        from mcp.types import ElicitResult

        self.asked.append(params.message)
        return ElicitResult(action=self._action, content=self._content if self._action == "accept" else None)


class Served:
    """A table that is served, its server, and what its audit log says."""

    def __init__(self, table, worker, server, log: Path) -> None:
        self.table, self.worker, self.server, self._log = table, worker, server, log
        self._before = 0  # lines of the audit log

    def begin(self) -> None:
        """Set the table as it was at the start, for the next test."""
        with suppress(UsageError):  # it still is
            self.worker.at_once(self.table._talk.reset)
        self._before = len(self._log.read_text().splitlines())

    @property
    def audit(self) -> list[dict]:
        """The lines of this test."""
        return [json.loads(line) for line in self._log.read_text().splitlines()[self._before :]]

    @property
    def world(self):
        return self.table._talk.table.world

    @property
    def poses(self) -> dict[str, list]:
        return {name: pose.tolist() for name, pose in self.table._talk.table.poses().items()}

    def stands_at(self, poses: dict[str, list]) -> bool:
        """Whether every object is at these poses again; undo sets them through the engine's quaternions."""
        return all(np.allclose(pose, poses[name], atol=1e-9) for name, pose in self.poses.items())

    def client(self, person: Person | None = None, mode: str = "legacy"):
        from mcp import Client

        return Client(self.server, mode=mode, elicitation_callback=person)

    def speak(self, conversation, person: Person | None = None, mode: str = "legacy") -> None:
        """Run `conversation(client)` with a client."""

        async def talk() -> None:
            with anyio.fail_after(300):
                async with self.client(person, mode) as client:
                    await conversation(client)

        anyio.run(talk)


@pytest.fixture(scope="session")
def models() -> ResourceCache:
    return ResourceCache()


@contextmanager
def serving(folder: Path, models: ResourceCache, approve_all: bool = False) -> Iterator[Served]:
    import_pybullet_silently()
    from agent.mcp.audit import AuditLog
    from agent.mcp.server import make_server
    from agent.mcp.shared_table import SharedTable
    from agent.mcp.worker import TableWorker

    worker = TableWorker()
    try:
        table = worker.at_once(lambda: SharedTable(OPTIONS, folder, models))
        try:
            with AuditLog(folder / "audit.jsonl") as log:
                yield Served(table, worker, make_server(table, worker, log, approve_all), folder / "audit.jsonl")
        finally:
            worker.at_once(table.close)
    finally:
        worker.close()


@pytest.fixture(scope="module")
def _served(tmp_path_factory, models) -> Iterator[Served]:
    with serving(tmp_path_factory.mktemp("served"), models) as served:
        yield served


@pytest.fixture
def served(_served) -> Served:
    _served.begin()
    return _served


async def data(client, tool: str, **arguments) -> dict:
    """Call a tool that has to succeed; return its structured result."""
    result = await client.call_tool(tool, arguments)
    assert not result.is_error, result.content[0].text
    assert json.loads(result.content[0].text) == result.structured_content
    return result.structured_content


async def refusal(client, tool: str, **arguments) -> str:
    """Call a tool that has to fail; return its sentence."""
    result = await client.call_tool(tool, arguments)
    assert result.is_error and len(result.content) == 1, result
    (sentence,) = result.content[0].text.splitlines()
    return sentence


async def plan(client, text: str = QUICK, number: int = 0) -> str:
    """Propose, and return the id of a plan."""
    return (await data(client, "propose", text=text))["plans"][number]["plan_id"]
