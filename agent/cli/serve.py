"""Serve a chat as a page with a live view: `structagent serve`, and the view beside `chat` and `run`."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from agent.cli.arguments import RunArguments, with_arguments
from agent.cli.options import (
    ForceOutOption,
)
from agent.runtime.output_ownership import claim_folder
from agent.runtime.output_paths import folder_or_new
from agent.runtime.stdio import import_pybullet_silently

if TYPE_CHECKING:
    from agent.live_view.live_view import LiveView

_PORT = 8642
ViewOption = Annotated[
    bool,
    typer.Option(
        "--view", help="Show what happens in the browser too, at the printed address (needs the extra `view`)."
    ),
]


@with_arguments
def serve(
    ctx: typer.Context,
    arguments: RunArguments,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the session; by default out/TIME-serve.")
    ] = None,
    force: ForceOutOption = False,
    host: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS", help="Address to listen on. Any but this machine's own, such as 0.0.0.0, needs a token."
        ),
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(metavar="PORT", min=0, max=65535, help="Port to listen on; 0 takes a free one.")
    ] = _PORT,
    token: Annotated[bool, typer.Option("--token", help="Ask pages of this machine for a token too.")] = False,
    execute: Annotated[
        bool, typer.Option("--execute/--no-execute", help="Build with the arm, or only check each goal without it.")
    ] = True,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Build the best arrangement without asking.")] = False,
    any_file: Annotated[
        bool,
        typer.Option(
            "--any-file",
            help="Let /load, /save, /example and /report in a page of this machine name any file, not only files in "
            "DIR and in the current folder.",
        ),
    ] = False,
) -> None:
    """Talk with the agent in the browser, and watch it work.

    The page shows the table, the arm and the proposed arrangements in three dimensions, with the chat beside them. Any
    number of pages may watch; one drives. Ctrl-C in the terminal ends it. Needs the extra `view`.

    Example: structagent serve --seed 2
    """
    from agent.live_view.server import check_installed

    check_installed()
    claim_folder(out, "chat", force)
    import_pybullet_silently()
    options = arguments.options(ctx, execute=execute)
    from agent.live_view.serve import serve_chat

    with folder_or_new(out, "serve") as folder:
        session = folder / "session.jsonl"
        code = serve_chat(options, session, host, port, token, yes, any_file)
    print(f"session: {session}", file=sys.stderr)
    if code:
        raise typer.Exit(code)


@contextmanager
def view_beside(wanted: bool) -> Iterator[LiveView | None]:
    """Open the live view beside a command whose terminal drives, if it is wanted; print its address.

    Raises:
        UsageError: without the package.
    """
    if not wanted:
        yield None
        return
    from agent.live_view.server import check_installed, server_beside

    check_installed()
    import_pybullet_silently()
    from agent.live_view.live_view import LiveView
    from agent.live_view.serve import announce

    with server_beside(_PORT) as server:
        announce(server.access)
        yield LiveView(server, transcript=True)
