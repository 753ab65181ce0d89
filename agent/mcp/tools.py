"""Declare the tools and resources of the server, and ask a person before anything moves."""

# No `from __future__ import annotations`: the annotations name functions of `add_tools`, and are read as they are made.

import base64
import json
from collections.abc import Sequence
from contextvars import ContextVar
from typing import Annotated, Any

from mcp.server.elicitation import AcceptedElicitation, CancelledElicitation, ElicitationResult
from mcp.server.mcpserver import Context, MCPServer
from mcp.server.mcpserver.resolve import Elicit, Resolve
from mcp.types import CallToolResult, ImageContent, TextContent, ToolAnnotations
from pydantic import BaseModel, Field, WrapValidator

from agent.errors import NotBuildable, UsageError
from agent.mcp import audit
from agent.mcp.audit import AuditedCall
from agent.mcp.quoting import quoted, readable_json
from agent.mcp.results import (
    BuildResult,
    LookResult,
    ParseResult,
    PreviewResult,
    ProposeResult,
    ReportResult,
    SayResult,
    StopResult,
    UndoResult,
)
from agent.mcp.shared_table import SharedTable
from agent.mcp.worker import Job, TableWorker
from agent.rendering.image_files import within_size
from agent.runtime.settings import MOST_SEED

LONGEST_TEXT = 2000  # characters of an instruction
_LONGEST_ID = 40
_MOST_TURNS = 10**9
_PICTURE = "image/webp"
_LARGEST_PICTURE = 200_000  # bytes: as base64 in a message it takes a third more
_ALLOWED = "no person has to be asked"  # what the resolvers return where nobody is asked

# The call that is being answered, for its line in the audit log.
current_call: ContextVar[AuditedCall] = ContextVar("current_call")

Instruction = Annotated[str, Field(max_length=LONGEST_TEXT, description="plain English, in the person's own words")]
PlanId = Annotated[str, Field(max_length=_LONGEST_ID, description="a plan_id that propose returned")]
_READS = ToolAnnotations(read_only_hint=True, destructive_hint=False, open_world_hint=False)
_TALKS = ToolAnnotations(read_only_hint=False, destructive_hint=False, open_world_hint=False)
_MOVES = ToolAnnotations(read_only_hint=False, destructive_hint=True, open_world_hint=False, idempotent_hint=False)


class Approval(BaseModel):
    """The answer of a person who was asked before something moves."""

    # Taken as the client sent it: pydantic would read "true", "yes" and 1 as a person's yes.
    approve: Annotated[bool, WrapValidator(lambda given, _: given)] = Field(
        title="Let it move", description="true lets the objects be moved, false refuses"
    )


class UndoPlan(BaseModel):
    """What undo would do, as it was when somebody was asked."""

    version: int
    moved: list[str]


def add_tools(server: MCPServer, table: SharedTable, worker: TableWorker, approve_all: bool) -> None:
    """Add the tools to a server.

    Args:
        server: the server.
        table: the table that they work on.
        worker: the thread that works on it.
        approve_all: whether things move without asking a person.
    """

    async def looked(context: Context) -> Annotated[CallToolResult, LookResult]:
        """Look at the table: objects with names and places, what is open in the conversation, and a picture."""
        result, picture = await worker.do(Job("the table is being observed"), table.look)
        return _answer(result, [picture])

    async def parsed(text: Instruction, context: Context) -> Annotated[CallToolResult, ParseResult]:
        """Show how a whole instruction would be read for this table; nothing is proposed, changed or moved."""
        return _answer(await worker.do(Job("an instruction is being read"), lambda job: table.parse(job, text)))

    async def proposed(text: Instruction, context: Context) -> Annotated[CallToolResult, ProposeResult]:
        """Propose arrangements for an instruction, a correction of the last one, or an answer to an open question.

        Pass on what the person said, unchanged. Nothing moves. Plans of an earlier proposal are void afterwards. The
        picture shows the first plan from above.
        """
        job = Job("arrangements are being proposed")
        result, pictures = await worker.do(job, lambda job: table.propose(job, text))
        return _answer(result, pictures)

    async def proposed_again(
        context: Context,
        seed: Annotated[
            int | None, Field(ge=0, le=MOST_SEED, description="of the arrangements; by default the next one")
        ] = None,
    ) -> Annotated[CallToolResult, ProposeResult]:
        """Propose other arrangements of the same wish. Nothing moves. Plans of the proposal before are void afterwards.

        The first plan differs visibly from those shown so far; a note says so if there is no such arrangement.
        """
        job = Job("other arrangements are being proposed")
        result, pictures = await worker.do(job, lambda job: table.propose_again(job, seed))
        return _answer(result, pictures)

    async def previewed(plan_id: PlanId, context: Context) -> Annotated[CallToolResult, PreviewResult]:
        """Try a plan in physics on a copy of the table, without the arm, and show it in pictures. Nothing moves."""
        job = Job("a plan is being tried in physics")
        result, pictures = await worker.do(job, lambda job: table.preview(job, plan_id))
        return _answer(result, pictures)

    async def build_approval(plan_id: str, context: Context) -> Elicit[Approval] | str:
        plan = table.plans.look_up(plan_id)
        question = (
            f"Let the robot arm build {plan_id}: {plan.wish}? It moves {_listed(plan.moves) or 'nothing'}. "
            "If it finds no way for exactly this arrangement, it builds another one of the same wish."
        )
        return _ask(question, context, approve_all)

    async def built(
        plan_id: PlanId, context: Context, approval: Annotated[ElicitationResult[Approval], Resolve(build_approval)]
    ) -> Annotated[CallToolResult, BuildResult]:
        """Let the arm build a plan. A person is asked first. Reports progress; cancelling the call stops the arm."""
        _check_approval(approval, "build", lambda: table.plans.drop(plan_id, "a person declined it"))
        current_call.get().write(audit.STARTED)
        job = Job(f"{plan_id} is being built", alone=True)
        return _answer(await worker.do(job, lambda job: table.build(job, plan_id), _progress(context)))

    async def say_approval(text: str, context: Context) -> Elicit[Approval] | str:
        line = table.spoken(text)
        if table.only_talks(line):
            return _ALLOWED
        question = (
            f"Let the robot arm take this while it builds: {quoted(line)}? It may then move other objects, or put them "
            "elsewhere, than was approved. It goes on meanwhile."
        )
        return _ask(question, context, approve_all)

    async def said(
        text: Instruction, context: Context, approval: Annotated[ElicitationResult[Approval], Resolve(say_approval)]
    ) -> Annotated[CallToolResult, SayResult]:
        """Say something while the arm builds: a correction, a question, an answer, "wait", "go on" or "stop".

        Pass on what the person said, unchanged. It is read at once; another goal takes effect before the next object is
        taken, around what stands. A person is asked first if it may change what moves.
        """
        _check_approval(approval, "say", lambda: None, "nothing was changed")
        if not table.only_talks(text):
            current_call.get().write(audit.STARTED)
        return _answer(await table.say(text))

    async def stopped(context: Context) -> Annotated[CallToolResult, StopResult]:
        """Stop the arm at once: it halts, sets down what it holds and folds. If it is at rest, drop the proposal."""
        job = await worker.stop()
        if job is not None and job.stopped:
            return _answer(StopResult(stopped=True, message=f"stopped while {job.what}"))
        return _answer(await worker.do(Job("the proposal is being dropped"), table.stop))

    async def undo_plan(context: Context) -> UndoPlan:
        version, moved = await worker.do(Job("the table is being compared"), table.moved_by_undo)
        return UndoPlan(version=version, moved=list(moved))

    async def undo_approval(context: Context, plan: Annotated[UndoPlan, Resolve(undo_plan)]) -> Elicit[Approval] | str:
        if not plan.moved:
            return _ALLOWED
        question = f"Undo the last turn? This puts back {_listed(plan.moved)} (step {plan.version})."
        return _ask(question, context, approve_all)

    async def undone(
        context: Context,
        plan: Annotated[UndoPlan, Resolve(undo_plan)],
        approval: Annotated[ElicitationResult[Approval], Resolve(undo_approval)],
    ) -> Annotated[CallToolResult, UndoResult]:
        """Restore the request and the simulated table as they were one turn ago. A person is asked if objects move."""
        _check_approval(approval, "undo", lambda: None)
        if plan.moved:
            current_call.get().write(audit.STARTED)
        job = Job("a turn is being undone", alone=True)
        return _answer(await worker.do(job, lambda job: table.undo(job, plan.version)))

    async def reported(
        context: Context,
        turn: Annotated[
            int | None, Field(ge=1, le=_MOST_TURNS, description="the number of a turn, from 1; by default the last one")
        ] = None,
    ) -> Annotated[CallToolResult, ReportResult]:
        """Return what became of a turn, with every check, and write the page of the conversation for a browser."""
        return _answer(await worker.do(Job("the report is being written"), lambda job: table.report(job, turn)))

    for name, tool, hints in (
        ("look", looked, _READS),
        ("parse", parsed, _READS),
        ("propose", proposed, _TALKS),
        ("propose_again", proposed_again, _TALKS),
        ("preview", previewed, _READS),
        ("build", built, _MOVES),
        ("say", said, _MOVES),
        ("stop", stopped, _TALKS),
        ("undo", undone, _MOVES),
        ("report", reported, _TALKS),
    ):
        server.add_tool(tool, name=name, annotations=hints, structured_output=True)


def add_resources(server: MCPServer, table: SharedTable, worker: TableWorker) -> None:
    """Add the scene, its picture, and the reports and pictures of the turns to a server."""

    @server.resource("structagent://scene", mime_type="application/json", description="the table and its objects")
    async def scene() -> str:
        result, _ = await worker.do(Job("the table is being observed"), table.look)
        return result.model_dump_json()

    @server.resource("structagent://scene/picture", mime_type=_PICTURE, description="the table through the camera")
    async def picture() -> bytes:
        return await worker.do(Job("the table is being photographed"), table.picture)

    @server.resource(
        "structagent://turns/{turn}/report.json", mime_type="application/json", description="the report of a turn"
    )
    async def report(turn: str) -> str:
        return table.record(_number(turn)).json()

    @server.resource(
        "structagent://turns/{turn}/report.html", mime_type="text/html", description="the page of a turn, with pictures"
    )
    async def page(turn: str) -> str:
        from agent.reporting.html.document import run_page

        return run_page(table.record(_number(turn)).turn)

    @server.resource(
        "structagent://turns/{turn}/pictures/{name}", mime_type=_PICTURE, description="a picture or film of a turn"
    )
    async def turn_picture(turn: str, name: str) -> bytes:
        pictures = dict(table.record(_number(turn)).pictures)
        if name not in pictures:
            raise UsageError(f"turn {turn} has no picture {quoted(name)}; legal: {', '.join(pictures) or 'none'}")
        return pictures[name]


def _number(turn: str) -> int:
    if not turn.isdecimal() or len(turn) > len(str(_MOST_TURNS)):
        raise UsageError(f"a turn is a number from 1, got {quoted(turn)}")
    return int(turn)


def _answer(result: BaseModel, pictures: list[bytes] | tuple[()] = ()) -> CallToolResult:
    """Return a result as data, as text for clients that read text alone, and with its pictures."""
    data = result.model_dump(mode="json")
    text = TextContent(type="text", text=readable_json(data))
    images = [
        ImageContent(
            type="image",
            data=base64.b64encode(within_size(picture, _LARGEST_PICTURE)).decode("ascii"),
            mime_type=_PICTURE,
        )
        for picture in pictures
    ]
    return CallToolResult(content=[text, *images], structured_content=data)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(map(quoted, names))


def _progress(context: Context) -> Any:
    async def report(number: int, step: str) -> None:
        await context.report_progress(number, message=step)

    return report


def _ask(question: str, context: Context, approve_all: bool) -> Elicit[Approval] | str:
    """Return the question to a person, or `_ALLOWED` where everything is approved.

    Raises:
        UsageError: if the client cannot ask; nothing moves then.
    """
    if approve_all:
        current_call.get().decision = audit.APPROVED_ALL
        return _ALLOWED
    _check_that_it_asks(context)
    return Elicit(question, Approval)


def _check_that_it_asks(context: Context) -> None:
    """Check that the client can ask a person.

    Raises:
        UsageError: if it cannot; nothing moves then.
    """
    capabilities = context.client_capabilities
    elicitation = capabilities.elicitation if capabilities is not None else None
    if elicitation is None or (elicitation.form is None and elicitation.url is not None):
        raise UsageError(
            "nothing was moved, because this client cannot ask a person (it does not support form elicitation); use "
            "a client "
            "that can, build with `structagent chat`, or start the server with --approve-all"
        )
    current_call.get().decision = audit.ASKED


def _check_approval(outcome: Any, what: str, on_refusal: Any, nothing: str = "nothing was moved") -> None:
    """Check that a person has approved, or that nobody had to.

    Raises:
        NotBuildable: if not; it begins with `nothing`.
    """
    call = current_call.get()
    if isinstance(outcome, AcceptedElicitation):
        if outcome.data is _ALLOWED:
            return
        given = outcome.data.approve
        if given is True:
            call.decision = audit.APPROVED
            return
        if given is not False:
            shown = quoted(json.dumps(given))[1:-1] if not isinstance(given, str) else quoted(given)
            raise NotBuildable(
                f"{nothing}: the client's answer was neither a yes nor a no, because approve is {shown} and not "
                f"the JSON value true or false; call {what} to ask again"
            )
    if isinstance(outcome, CancelledElicitation):
        call.decision = audit.DISMISSED
        raise NotBuildable(f"{nothing}: the question was closed without an answer; call {what} to ask again")
    call.decision = audit.DECLINED
    on_refusal()
    raise NotBuildable(f"{nothing}: the person declined {what}; ask what should be different")
