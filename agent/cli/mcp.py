"""Serve one table to other programs: `structagent mcp`."""

from __future__ import annotations

import os
import sys
from datetime import datetime
from enum import StrEnum
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from agent.cli.arguments import RunArguments, with_arguments
from agent.cli.options import (
    ForceOutOption,
)
from agent.errors import UsageError
from agent.runtime.output_ownership import claim_folder
from agent.runtime.output_paths import state_folder
from agent.runtime.settings import TOKEN_VARIABLE
from agent.runtime.stdio import import_pybullet_silently


class Transport(StrEnum):
    """The ways in which clients reach the server."""

    stdio = "stdio"
    http = "http"


@with_arguments
def mcp(
    ctx: typer.Context,
    arguments: RunArguments,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder for the session; by default ~/.local/state/structagent/mcp/TIME-PROCESS."
        ),
    ] = None,
    force: ForceOutOption = False,
    transport: Annotated[
        Transport,
        typer.Option(
            metavar="|".join(Transport),
            help="How clients reach it: standard input and output of this process, or streamable HTTP.",
        ),
    ] = Transport.stdio,
    host: Annotated[
        str,
        typer.Option(
            metavar="HOST", help="With http: where to listen. Clients on other machines need the bearer token."
        ),
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(metavar="N", min=0, max=65535, help="With http: the port; 0 for any that is free.")
    ] = 8321,
    allow_host: Annotated[
        list[str] | None,
        typer.Option(metavar="HOST", help="With http: another name by which clients call this machine. Repeatable."),
    ] = None,
    approve_all: Annotated[
        bool, typer.Option("--approve-all", help="Let the arm move without asking a person first.")
    ] = False,
    audit: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Audit log, a JSON line for every call; by default DIR/audit.jsonl."),
    ] = None,
) -> None:
    """Serve one table to programs and language models by the Model Context Protocol.

    Clients look at the table, propose, preview, build, stop and undo, as in a chat. A person is asked before the arm
    moves. With http, a bearer token in STRUCTAGENT_MCP_TOKEN is required of every client; without it, one is made and
    printed if other machines can reach the server. Needs the extra `mcp`.

    Example: structagent mcp --scene desk.yaml
    """
    given = [ctx.get_parameter_source(name) for name in ("host", "port", "allow_host")]
    if transport is Transport.stdio and any(source is not None and source.name == "COMMANDLINE" for source in given):
        raise UsageError("--host, --port and --allow-host need --transport http")
    folder = out or _default_folder()
    claim_folder(folder, "chat", force)
    import_pybullet_silently()
    options = arguments.options(ctx)
    if find_spec("mcp") is None:
        raise UsageError(
            "structagent mcp needs the package mcp, and it is not installed; pip install 'structagent[mcp]' does it"
        )
    from agent.mcp.serving import Address, serve

    address = Address(host, port, tuple(allow_host or ()), os.environ.get(TOKEN_VARIABLE) or None)
    serve(
        options,
        folder,
        audit or folder / "audit.jsonl",
        approve_all,
        address if transport is Transport.http else None,
        _say,
    )


def _default_folder() -> Path:
    """Return a new folder that does not depend on the current one, because clients start servers anywhere."""
    return (state_folder() or Path("out")) / "mcp" / f"{datetime.now():%Y%m%d-%H%M%S}-{os.getpid()}"


def _say(line: str) -> None:
    print(f"structagent mcp: {line}", file=sys.stderr, flush=True)
