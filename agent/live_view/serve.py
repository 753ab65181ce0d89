"""Run a chat whose screen and keyboard are a page in the browser."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from agent.chat.file_access import FileAccess
from agent.chat.run import converse
from agent.live_view.access import Access, is_any_address, is_loopback
from agent.live_view.driver_lines import DriverLines
from agent.live_view.live_view import LiveView
from agent.live_view.server import ViewServer
from agent.live_view.transcript import page_screen

if TYPE_CHECKING:
    from agent.pipeline.run import RunOptions


def serve_chat(
    options: RunOptions, session: Path, host: str, port: int, token: bool, yes: bool, any_file: bool = False
) -> int:
    """Serve a chat until Ctrl-C in the terminal.

    Args:
        options: the options of a run.
        session: the session file; an existing one is continued.
        host: the address to listen on.
        port: the port; 0 takes a free one.
        token: whether pages of this machine need a token too.
        yes: whether to build without asking.
        any_file: whether pages of this machine may name any file, not only those beside the session and in the working
            folder.

    Returns:
        The exit code, as that of a chat in the terminal.

    Raises:
        UsageError: without the package, and for an address that cannot be listened on.
    """
    lines = DriverLines(files=is_loopback(host))
    with ViewServer(host, port, token, lines.actions) as server:
        screen = page_screen(server, echo=False)
        lines.show_on(server, screen.said)
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # a shell's background job has to stop the arm too
            signal.signal(signal.SIGINT, signal.default_int_handler)
        announce(server.access, "Ctrl-C stops the arm, and ends the view when nothing is at work")
        view = LiveView(server, transcript=False)
        access = FileAccess(None if any_file else (session.parent.absolute(), Path.cwd()))
        return converse(options, screen, session, lines.answer_for, yes, sys.stderr, view, access)


def announce(access: Access, more: str = "") -> None:
    """Print the address of the page to standard error, and what else is to know."""
    print(f"live view: {access.address}", file=sys.stderr)
    if is_any_address(access.host):
        print("on other machines, the name of this one takes the place of 127.0.0.1", file=sys.stderr)
    if more:
        print(more, file=sys.stderr, flush=True)
