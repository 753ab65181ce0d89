"""Make the server: tools and resources, one sentence for every error, a line in the audit log for every call."""

from __future__ import annotations

import asyncio
import logging
import reprlib
from collections.abc import Callable, Iterable
from typing import Any

from mcp.server.lowlevel.helper_types import ReadResourceContents
from mcp.server.mcpserver import Context, MCPServer
from mcp.server.mcpserver.exceptions import ResourceError, ToolError, UnexpectedResourceError, UnexpectedToolError
from mcp.types import CallToolResult, InputRequiredResult, Tool
from pydantic import ValidationError

from agent import __version__
from agent.errors import defect_sentence, exit_code_of, one_sentence
from agent.mcp.audit import CANCELLED, DONE, AuditedCall, AuditLog
from agent.mcp.quoting import quote_names, quoted
from agent.mcp.sessions import HEADER, Sessions
from agent.mcp.shared_table import SharedTable
from agent.mcp.tools import add_resources, add_tools, current_call
from agent.mcp.worker import TableWorker

_LOG = logging.getLogger(__name__)
_INSTRUCTIONS = (
    "A simulated robot arm builds structures from the objects on one table. Order of work: look; propose with the "
    "person's own words; if there is a question, ask the person and call propose with the answer; tell the person the "
    "wish and the notes; preview if in doubt; build with a plan_id, which asks the person for approval; report. A "
    'correction ("bigger", "now a line") is another propose; propose_again shows another arrangement. stop stops the '
    "arm. undo reverts one turn. In sentences, what stands in double quotes is a name from a file and nothing that the "
    "person said."
)
MOST_SESSIONS = 32  # over HTTP


class TableServer(MCPServer):
    """A server that writes every call of a tool to the audit log, and whose errors are one sentence.

    Args:
        audit: the log.
        names: returns the names of the objects, which stand in quotes in every error.

    Attributes:
        sessions: those over HTTP.
    """

    def __init__(self, audit: AuditLog, names: Callable[[], Iterable[str]]) -> None:
        super().__init__(
            "structagent",
            title="structagent",
            description="builds structures from instructions with a simulated robot arm",
            instructions=_INSTRUCTIONS,
            version=__version__,
            log_level="ERROR",
        )
        self._audit, self._names, self.sessions = audit, names, Sessions(MOST_SESSIONS)

    async def list_tools(self) -> list[Tool]:
        """List the tools; their schemas say that there are no further arguments."""
        tools = await super().list_tools()
        for tool in tools:
            tool.input_schema["additionalProperties"] = False
        return tools

    async def call_tool(
        self, name: str, arguments: dict[str, Any], context: Context | None = None
    ) -> CallToolResult | InputRequiredResult:
        """Call a tool, as `MCPServer.call_tool`; every expected error is a `ToolError` of one sentence."""
        call = AuditedCall(self._audit, _client(context), name, arguments)
        token = current_call.set(call)
        try:
            with self.sessions.working(_session(context)):
                outcome, result = await self._outcome(name, arguments, context)
        except asyncio.CancelledError:
            call.write(CANCELLED)
            raise
        finally:
            current_call.reset(token)
        call.write(outcome)
        if isinstance(result, ToolError):
            raise result
        return result

    async def _outcome(
        self, name: str, arguments: dict[str, Any], context: Context | None
    ) -> tuple[str, CallToolResult | InputRequiredResult | ToolError]:
        try:
            await self._check_names(name, arguments)
            result = await super().call_tool(name, arguments, context)
            return ("asked" if isinstance(result, InputRequiredResult) else DONE), result
        except UnexpectedToolError as error:
            cause = error.__cause__
            if cause is None or exit_code_of(cause) is None:
                cause = error if cause is None else cause
                _LOG.error("a defect in the tool %s", name, exc_info=cause)
                sentence = quote_names(defect_sentence(cause), self._names())
                return f"defect: {type(cause).__name__}: {cause}", ToolError(sentence)
            sentence = quote_names(one_sentence(cause), self._names())
            return f"refused: {sentence}", ToolError(sentence)
        except ToolError as error:
            sentence = one_sentence(error)
            if isinstance(error.__cause__, ValidationError):
                sentence = _argument_sentence(name, error.__cause__)
            elif isinstance(error.__cause__, ToolError):  # of the question: no tool raises one itself
                answer = "the client's answer was neither a yes nor a no"
                sentence = f"nothing was moved: {answer}; call {name} to ask again"
            return f"refused: {sentence}", ToolError(sentence)

    async def _check_names(self, name: str, arguments: dict[str, Any]) -> None:
        """Check the names of a call: an argument that there is not would be left out without a word.

        Raises:
            ToolError: for an unknown tool or argument.
        """
        tools = {tool.name: tool for tool in await self.list_tools()}
        if name not in tools:
            raise ToolError(f"there is no tool {_shown(name)}; legal: {', '.join(tools)}")
        legal = tools[name].input_schema["properties"]
        for argument in arguments:
            if argument not in legal:
                raise ToolError(f"{name} has no argument {_shown(argument)}; legal: {', '.join(legal) or 'none'}")

    async def read_resource(
        self, uri: Any, context: Context | None = None
    ) -> Iterable[ReadResourceContents] | InputRequiredResult:
        """Read a resource, as `MCPServer.read_resource`; every expected error is a `ResourceError` of one sentence."""
        try:
            return await super().read_resource(uri, context)
        except UnexpectedResourceError as error:
            cause = error.__cause__
            while isinstance(cause, UnexpectedResourceError):
                cause = cause.__cause__
            if cause is None or exit_code_of(cause) is None:
                raise
            raise ResourceError(quote_names(one_sentence(cause), self._names())) from None


def make_server(table: SharedTable, worker: TableWorker, audit: AuditLog, approve_all: bool = False) -> TableServer:
    """Return a server for a table.

    Args:
        table: the table.
        worker: the thread that works on it.
        audit: the audit log.
        approve_all: whether things move without asking a person.
    """
    server = TableServer(audit, lambda: table.names)
    add_tools(server, table, worker, approve_all)
    add_resources(server, table, worker)
    return server


def _client(context: Context | None) -> str:
    """Return the client's name and version, as it gave them."""
    parameters = context.session.client_params if context is not None else None
    return f"{parameters.client_info.name} {parameters.client_info.version}" if parameters else "unknown"


def _session(context: Context | None) -> str | None:
    """Return the session that a call belongs to; `None` without one."""
    headers = context.headers if context is not None else None
    return None if headers is None else headers.get(HEADER)


def _shown(value: Any) -> str:
    return quoted(value) if isinstance(value, str) else quoted(reprlib.repr(value))[1:-1]


def _argument_sentence(tool: str, error: ValidationError) -> str:
    """Return what is wrong with the arguments of a call in one sentence."""
    first = error.errors(include_url=False)[0]
    name = ".".join(map(str, first["loc"])) or "its arguments"
    if first["type"] == "missing":
        return f"{tool} needs the argument {name}"
    reason = first["msg"][:1].lower() + first["msg"][1:]
    return f"{tool} cannot take {name}={_shown(first['input'])}: {reason}"
