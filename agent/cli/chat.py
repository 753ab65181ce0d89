"""Start a dialogue with the agent about one table: `structagent chat`."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from agent.cli.arguments import RunArguments, with_arguments
from agent.cli.examples import ExactOption, LikeOption, check_example
from agent.cli.options import (
    ForceOutOption,
    arm_file,
)
from agent.cli.serve import ViewOption, view_beside
from agent.errors import UsageError
from agent.runtime.output_ownership import OwnFolder, claim_folder
from agent.runtime.output_paths import folder_or_new
from agent.runtime.stdio import import_pybullet_silently, results_stream
from agent.runtime.terminal_text import console_on

_GREETING = "Setting the table ..."


@with_arguments
def chat(
    ctx: typer.Context,
    arguments: RunArguments,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the session; by default out/TIME-chat.")
    ] = None,
    force: ForceOutOption = False,
    execute: Annotated[
        bool, typer.Option("--execute/--no-execute", help="Build with the arm, or only check each goal without it.")
    ] = True,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Build the best arrangement without asking.")] = False,
    view: ViewOption = False,
    like: LikeOption = None,
    exact: ExactOption = False,
) -> None:
    """Talk with the agent about one table.

    Ask for a structure, correct it, have it built, undo it. /help lists all commands. If standard input is not a
    terminal, it is read line by line.

    Example: structagent chat --scene desk.yaml
    """
    claim_folder(out, "chat", force)
    check_example(like, exact, arguments.reading.parser)
    arguments.recorded()  # a wrong option is told before anything is made
    arm_file(arguments.arm)
    if sys.stdin is None:
        raise UsageError("chat needs standard input, which is closed")
    sys.stdin.reconfigure(errors="replace")  # type: ignore[union-attr]  # a stray byte is no reason to stop
    with folder_or_new(out, "chat") as folder, results_stream() as results, view_beside(view) as viewer:
        console = console_on(results)
        console.print(_GREETING, style="dim", highlight=False)  # before the imports below, which take seconds
        import_pybullet_silently()
        from agent.chat.run import run_chat

        options = arguments.options(ctx, execute=execute, example=like, exact=exact)
        if like is not None:
            from agent.figures.examples import keep_example

            example = keep_example(like, exact, OwnFolder(folder, "chat"))
            options = replace(options, reading=replace(options.reading, like=example, like_always=False))
        session = folder / "session.jsonl"
        code = run_chat(options, console, session, sys.stdin, yes, viewer)
    print(f"session: {session}", file=sys.stderr)
    if code:
        raise typer.Exit(code)
