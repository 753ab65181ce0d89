"""Convert a session file to a page of its turns, or send its events to a listener again."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from agent.errors import NotWritten, UsageError
from agent.event_base import Listener, RecordedEvent
from agent.reporting.html.document import session_page
from agent.reporting.run_report import RunRecord
from agent.reporting.session_reader import Session, read_session
from grounding.atomic_files import write_whole


def records_of(session: Session) -> list[RunRecord]:
    """Make one record for each turn, and one for events before the first instruction, if any.

    A turn without an observation of its own uses that of the previous turn.
    """
    records = [RunRecord()]
    scene = None
    for line in session.lines:
        if line.picture is not None:
            records[-1].on_picture(line.picture)
        if line.table is not None:
            records[-1].on_table(line.table)
        if line.event is None:
            continue
        if line.event["kind"] == "started":
            records.append(RunRecord())
        records[-1].on_event(RecordedEvent(line.event))
        report = records[-1].report
        if line.event["kind"] == "proposed" and report["scene"] is None:
            report["scene"] = scene
        scene = report["scene"] or scene
    before = records[0].report
    return records if before["scene"] or before["remarks"] else records[1:]


def write_page(session: Path, page: Path) -> Path:
    """Make the page of a session file.

    Args:
        session: the file.
        page: the path of the page; its folder is created if missing.

    Returns:
        `page`.

    Raises:
        BadInput: for a file that is no session, or a broken one.
        UsageError: if the page has no file of its own.
        NotWritten: if it cannot be written there; an earlier page is then whole.
    """
    if page.is_dir() or page.resolve() == session.resolve():
        what = "a folder" if page.is_dir() else "the session itself"
        raise UsageError(f"the page needs a file of its own, but {str(page)!r} is {what}")
    read = read_session(session)
    content = session_page(read, [record.turn for record in records_of(read)])
    try:
        write_whole(page, content)
    except OSError as error:
        raise NotWritten(f"cannot write the page {str(page)!r}: {error.strerror}") from error
    return page


def replay(
    session: Session,
    listener: Listener,
    speed: float | None = None,
    sleep: Callable[[float], None] = time.sleep,
) -> None:
    """Send the events of a session to a listener again, in order.

    Args:
        session: the events.
        listener: gets the events.
        speed: how many times as fast as it happened; `None` for at once.
        sleep: waits for a number of seconds.
    """
    passed = 0.0
    for line in session.lines:
        if line.event is None:
            continue
        if speed is not None:
            sleep((line.seconds - passed) / speed)
            passed = line.seconds
        listener.on_event(RecordedEvent(line.event))
