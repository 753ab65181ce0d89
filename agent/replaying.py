"""A session file shown again: its turns for the page, its events for the terminal."""

from __future__ import annotations

import time
from collections.abc import Callable

from rich.console import Console
from rich.markup import escape

from agent.record import RunRecord
from agent.report import TerminalReport
from agent.session_file import Session


def records_of(session: Session) -> list[RunRecord]:
    """One record for each turn; what was told before the first instruction, if anything, is one too.

    A turn that did not look at the table worked on what the turn before it saw.
    """
    records = [RunRecord()]
    scene = None
    for line in session.lines:
        if line.picture is not None:
            records[-1].take_picture(line.picture)
        if line.event is None:
            continue
        if line.event["kind"] == "started":
            records.append(RunRecord())
        records[-1].take(line.event)
        report = records[-1].report
        if line.event["kind"] == "imagined" and report["scene"] is None:
            report["scene"] = scene
        scene = report["scene"] or scene
    before = records[0].report
    return records if before["scene"] or before["remarks"] else records[1:]


def replay(
    session: Session, console: Console, speed: float | None = None, sleep: Callable[[float], None] = time.sleep
) -> None:
    """Tells a session again as it was told when it happened.

    Args:
        session: what is told.
        console: where to tell.
        speed: how many times as fast as it happened; `None` for at once. Pauses are made on a terminal alone.
        sleep: waits for so many seconds.
    """
    tell = TerminalReport(console)
    passed = 0.0
    for line in session.lines:
        if line.event is None:
            continue
        if speed is not None and console.is_terminal:
            sleep((line.seconds - passed) / speed)
            passed = line.seconds
        if line.event["kind"] == "started":
            console.print()
        tell.tell(line.event)
        if line.event["kind"] == "failed":  # when it happened, the command ended with this
            message = f"stopped at {line.event['step']}: {line.event['message']}"
            console.print(f"\n[red]{escape(message)}[/red]", highlight=False, soft_wrap=True)
