"""Session files: everything that was told, one JSON object a line, written as it happens and never changed again.

The first line says what the session is; it stands again where a later process goes on with the file:

    {"schema_version": 1, "version": "0.1.0", "started": "2025-01-31T09:30:00+00:00", "options": {...}, "machine": ...}

Every other line is an event (`agent.events`, as it tells itself) or a picture; `seconds` count from the latest start:

    {"seconds": 1.25, "event": {"kind": "started", "instruction": "stack the cans", "options": {...}}}
    {"seconds": 2.5, "picture": {"name": "scene-before", "caption": "...", "format": "webp", "data": "<base64>"}}

An event `started` begins a turn. Each line is written at once, so that a process that is killed loses at most the line
that it was writing; such a torn line is passed over. Keys and passwords are never in a session.
"""

from __future__ import annotations

import base64
import binascii
import fcntl
import json
import os
import platform
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from agent import __version__, events
from agent.errors import BadInput, NotWritten, UsageError
from agent.rendering.image_files import FORMAT, Picture
from agent.reporting.event_schema import complaint, inconsistency
from agent.runtime.atomic_files import unfinished_file
from agent.runtime.output_ownership import files_written, mark
from agent.runtime.redaction import without_credentials
from structdiffusion.limits import SESSION_BYTES, SESSION_START_BYTES

SCHEMA_VERSION = 1
RUN_SESSION = "session.jsonl"
_PASSING = frozenset({"previewed"})  # of interest while it happens alone


class SessionWriter:
    """Writes a session; use it in a `with` block.

    Args:
        path: the file; one that is there already is gone on with.
        options: of the command, for the first line.
        anew: replace a file that is there already.
        from_kind: write nothing before an event of this kind was told, and then all that was told before it too.
        owner: the kind of command whose output the file's folder is marked as (`agent.runtime.output_ownership`); `None` for no mark.

    Raises:
        UsageError: when another process writes the file, or it is something else than a session.
        NotWritten: when the file cannot be written, also later.
    """

    def __init__(
        self,
        path: Path,
        options: Mapping[str, Any],
        *,
        anew: bool = False,
        from_kind: str | None = None,
        owner: str | None = None,
    ) -> None:
        self.path, self._owner = path, owner
        self._began = time.perf_counter()
        self._anew, self._from_kind = anew, from_kind
        self._file: Any = None
        first = {
            "schema_version": SCHEMA_VERSION,
            "version": __version__,
            "started": datetime.now(UTC).isoformat(timespec="seconds"),
            "options": without_credentials(events.json_value(options)),
            "machine": f"Python {platform.python_version()}, {platform.system()} {platform.machine()}",
        }
        self._waiting = [_line(first)]
        if from_kind is None:
            self._open()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Closes the file; closing twice does nothing."""
        if self._file is not None:
            self._file.close()
            self._file = None
        self._waiting = []

    def __call__(self, event: events.Event) -> None:
        """Writes one event."""
        self.tell(event.to_dict())

    def tell(self, told: Mapping[str, Any]) -> None:
        """Writes one event in its JSON form; what is of passing interest is left out."""
        if told["kind"] in _PASSING:
            return
        self._write({"event": without_credentials(told)})
        if self._file is None and told["kind"] == self._from_kind:
            self._open()

    def picture(self, picture: Picture) -> None:
        """Writes one picture."""
        data = base64.b64encode(picture.content).decode("ascii")
        self._write(
            {"picture": {"name": picture.name, "caption": picture.caption, "format": FORMAT, "data": data}}
        )

    def _write(self, entry: Mapping[str, Any]) -> None:
        line = _line({"seconds": round(time.perf_counter() - self._began, 3), **entry})
        if self._file is None:
            self._waiting.append(line)
        else:
            self._put(line)

    def _open(self) -> None:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if self._owner is not None:
                mark(self.path.parent, self._owner, files_written(self.path.parent, self._owner) | {self.path.name})
            self._file = self._replaced() if self._anew else self._continued()
        except BlockingIOError as error:
            raise UsageError(f"another process writes the session {str(self.path)!r}; choose another folder") from error
        except OSError as error:
            raise self._not_written(error) from error
        self._waiting = []

    def _continued(self) -> Any:
        """The file, open and locked, with what was waiting at its end; a symbolic link is not followed."""
        torn = not self.path.is_symlink() and self.path.exists() and _is_torn(self.path)
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW
        file = os.fdopen(os.open(self.path, flags, 0o666), "ab", buffering=0)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            _write(file, (b"\n" if torn else b"") + b"".join(self._waiting))
        except OSError:
            file.close()
            raise
        return file

    def _replaced(self) -> Any:
        """A new file, open and locked, with what was waiting, in the place of the earlier one, if there is any."""
        with ExitStack() as until_replaced:
            if self.path.exists() and not self.path.is_symlink():
                earlier = until_replaced.enter_context(self.path.open("rb"))
                fcntl.flock(earlier, fcntl.LOCK_EX | fcntl.LOCK_NB)
            file, unfinished = unfinished_file(self.path)
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                _write(file, b"".join(self._waiting))
                os.replace(unfinished, self.path)
            except BaseException:
                file.close()
                unfinished.unlink(missing_ok=True)
                raise
        return file

    def _put(self, content: bytes) -> None:
        try:
            _write(self._file, content)
        except OSError as error:
            raise self._not_written(error) from error

    def _not_written(self, error: OSError) -> NotWritten:
        return NotWritten(f"cannot write the session {str(self.path)!r}: {error.strerror}")


def run_session(folder: Path, options: Mapping[str, Any]) -> SessionWriter:
    """The session of one run in its report's folder: `session.jsonl`, in the place of an earlier run's.

    Args:
        folder: made, with the file, when the run has seen something; before that there is nothing worth a folder.
        options: of the run.
    """
    return SessionWriter(folder / RUN_SESSION, options, anew=True, from_kind="perceived", owner="run")


@dataclass(frozen=True)
class SessionLine:
    """One line of a session: an event or a picture.

    Attributes:
        seconds: since the session began; where it was gone on with, since then, on top of what had passed before.
        event: the event's JSON form, or `None`.
        picture: or `None`.
    """

    seconds: float
    event: Mapping[str, Any] | None = None
    picture: Picture | None = None


@dataclass(frozen=True)
class Session:
    """A session that was read.

    Attributes:
        version: of the structagent that wrote it.
        started: when it began, as ISO 8601 has it.
        machine: what it ran on.
        options: of the command.
        lines: events and pictures, in order.
    """

    version: str
    started: str
    machine: str
    options: Mapping[str, Any]
    lines: tuple[SessionLine, ...]


def read_session(path: Path) -> Session:
    """Reads a session file.

    A torn line is passed over where a process may have left one: at the end, and before another's first line.

    Raises:
        BadInput: when there is no such file, or it is no session, or one of another schema version, or a line of it is
            broken; the message has the line's number.
    """
    try:
        with path.open("rb") as file:  # a pipe is read once
            content = file.read(SESSION_START_BYTES)
            if _is_start(_parsed(content.lstrip().partition(b"\n")[0])):
                content += file.read(SESSION_BYTES + 1 - len(content))
    except OSError as error:
        raise BadInput(f"cannot read the session {str(path)!r}: {error.strerror}") from error
    if len(content) > SESSION_BYTES:
        raise BadInput(f"the session {str(path)!r} has more than {SESSION_BYTES} bytes, and no more are read")
    texts = content.split(b"\n")
    entries = [(number, _parsed(text)) for number, text in enumerate(texts, start=1) if text.strip()]
    if not entries or not _is_start(entries[0][1]):
        raise BadInput(f"{str(path)!r} is no session of structagent: its first line does not say so")
    first: Mapping[str, Any] = entries[0][1]
    return Session(
        str(first["version"]), first["started"], str(first["machine"]), first["options"], tuple(_lines(path, entries))
    )


def _lines(path: Path, entries: list[tuple[int, Any]]) -> Iterator[SessionLine]:
    before = latest = 0.0
    part = 0  # how many objects of the scene take part
    for place, (number, entry) in enumerate(entries):
        where = f"line {number} of {str(path)!r}"
        if _is_start(entry):
            if entry["schema_version"] != SCHEMA_VERSION:
                found = entry["schema_version"]
                raise BadInput(f"{where} has schema version {found!r}; this structagent reads {SCHEMA_VERSION}")
            before = latest
        elif entry is None:
            if place + 1 < len(entries) and not _is_start(entries[place + 1][1]):
                raise BadInput(f"{where} is no JSON")
        else:
            line = _session_line(entry, where)
            latest = before + line.seconds
            if line.event is not None:
                problem = inconsistency(line.event, part)
                if problem:
                    raise BadInput(f"{where}: {problem}")
                if line.event["kind"] == "perceived":
                    part = sum(seen["takes_part"] for seen in line.event["objects"])
            yield SessionLine(latest, line.event, line.picture)


def _session_line(entry: Any, where: str) -> SessionLine:
    seconds = entry.get("seconds") if isinstance(entry, dict) else None
    if isinstance(seconds, bool) or not isinstance(seconds, int | float) or not 0 <= seconds < float("inf"):
        raise BadInput(f'{where} must be an object with "seconds", a number from 0')
    if "event" in entry:
        problem = complaint(entry["event"])
        if problem:
            raise BadInput(f"{where}: {problem}")
        return SessionLine(seconds, event=entry["event"])
    picture = entry.get("picture")
    keys = ("name", "caption", "format", "data")
    if not isinstance(picture, dict) or not all(isinstance(picture.get(key), str) for key in keys):
        raise BadInput(f'{where} must have an "event", or a "picture" with the strings {", ".join(keys)}')
    if picture["format"] != FORMAT:
        raise BadInput(f"{where}: a picture's format cannot be {picture['format']!r}; legal: {FORMAT}")
    try:
        data = base64.b64decode(picture["data"], validate=True)
    except (binascii.Error, ValueError) as error:
        raise BadInput(f"{where}: the picture's data is no base64") from error
    return SessionLine(seconds, picture=Picture(picture["name"], picture["caption"], data))


def _is_start(entry: Any) -> bool:
    """Whether this is a session's first line, of whatever schema version."""
    return isinstance(entry, dict) and {"schema_version", "version", "started", "machine"} <= entry.keys() and (
        isinstance(entry["started"], str) and isinstance(entry.get("options"), dict)
    )


def _parsed(text: bytes) -> Any:
    """The JSON value of a line; `None`, which is no line of a session, where it is none."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):  # a UnicodeDecodeError is a ValueError too
        return None


def _line(entry: Mapping[str, Any]) -> bytes:
    return json.dumps(entry, ensure_ascii=False, allow_nan=False).encode("utf-8", errors="replace") + b"\n"


def _write(file: Any, content: bytes) -> None:
    """Writes all of it at the end of an unbuffered file, or nothing."""
    size = os.fstat(file.fileno()).st_size
    try:
        while content:  # a system takes part of it where the disk is nearly full
            content = content[file.write(content) :]
    except OSError:
        with suppress(OSError):
            os.ftruncate(file.fileno(), size)  # half a line would make what follows it unreadable
        raise


def _is_torn(path: Path) -> bool:
    """Whether the last line of a session that is there already has no end.

    Raises:
        UsageError: when the file is something else, which must not be written into.
    """
    with path.open("rb") as file:
        first = file.readline(SESSION_START_BYTES)
        if first and not _is_start(_parsed(first)):
            raise UsageError(f"{str(path)!r} is there already, and is no session that could be gone on with")
        file.seek(max(file.seek(0, 2) - 1, 0))
        return file.read(1) not in (b"", b"\n")
