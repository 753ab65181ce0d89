"""Show session files again, or as a page: `structagent replay` and `structagent report`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from agent.cli.options import JsonOption
from agent.errors import UsageError
from agent.runtime.stdio import results_stream
from agent.runtime.terminal_text import console_on

SessionArgument = Annotated[
    Path, typer.Argument(metavar="FILE", help="Session file, such as the session.jsonl of a run.", show_default=False)
]


def replay(
    file: SessionArgument,
    speed: Annotated[
        float | None,
        typer.Option(
            metavar="X",
            help="Show the session X times as fast as it was; by default without pauses. On a terminal only.",
        ),
    ] = None,
    json_output: JsonOption = False,
) -> None:
    """Show a session again in the terminal.

    With --json the events are printed, one per line.

    Example: structagent replay out/cups/session.jsonl --speed 4
    """
    if speed is not None and not 0 < speed < float("inf"):
        raise UsageError(f"--speed cannot be {speed:g}; legal: a number above 0")
    from agent.chat.view import ChatScreen
    from agent.reporting.replay import replay as show
    from agent.reporting.session_reader import read_session

    session = read_session(file)
    with results_stream() as results:
        if json_output:
            for line in session.lines:
                if line.event is not None:
                    print(json.dumps({"seconds": line.seconds, "event": line.event}, ensure_ascii=False), file=results)
            return
        console = console_on(results)
        screen = ChatScreen(console, echo=True)
        try:
            show(session, screen, speed if console.is_terminal else None)
        finally:
            screen.idle()


def report(
    file: SessionArgument,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="File for the page; by default beside the session file, as .html."),
    ] = None,
) -> None:
    """Write a session as an HTML page.

    The page is one file with every turn, its pictures and its films.

    Example: structagent report session.jsonl --out session.html
    """
    from agent.reporting.replay import write_page

    page = write_page(file, out or file.with_suffix(".html"))
    with results_stream() as results:
        print(f"report: {page}", file=results)
