"""Write session files: all events, one JSON object per line (see `agent.reporting.session_format`).

Each line is written at once and never changed again, so that a process that is killed loses at most the line that it
was writing; such an incomplete line is skipped when the file is read. Keys and passwords are never in a session.
"""

from __future__ import annotations

import base64
import fcntl
import os
import platform
import stat
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from agent import __version__
from agent.errors import NotWritten, UsageError
from agent.event_base import Event, json_value
from agent.rendering.image_files import FORMAT, Picture
from agent.reporting.session_format import SCHEMA_VERSION, decode_line, encode_line, is_start
from agent.runtime.output_ownership import files_written, mark, own_folder
from agent.runtime.redaction import without_credentials
from grounding.atomic_files import OpenFolder, opened
from structdiffusion.limits import SESSION_START_BYTES

RUN_SESSION = "session.jsonl"
_PASSING = frozenset({"previewed"})  # of interest while it happens alone


class SessionWriter:
    """Writes a session; use it in a `with` block.

    Args:
        path: the file; one that exists is continued.
        options: of the command, for the first line.
        replace: replace a file that exists.
        from_kind: write nothing before an event of this kind comes, and then everything before it too.
        owner: the kind of command whose output the file's folder is marked as (`agent.runtime.output_ownership`);
            `None` for no mark.

    Raises:
        UsageError: if another process writes the file, or it is something else than a session.
        NotWritten: if the file cannot be written, also later.
    """

    def __init__(
        self,
        path: Path,
        options: Mapping[str, Any],
        *,
        replace: bool = False,
        from_kind: str | None = None,
        owner: str | None = None,
    ) -> None:
        self.path, self._owner = path, owner
        self._began = time.perf_counter()
        self._replace, self._from_kind = replace, from_kind
        self._file: Any = None
        first = {
            "schema_version": SCHEMA_VERSION,
            "version": __version__,
            "started": datetime.now(UTC).isoformat(timespec="seconds"),
            "options": without_credentials(json_value(options)),
            "machine": f"Python {platform.python_version()}, {platform.system()} {platform.machine()}",
        }
        self._waiting = [encode_line(first)]
        if from_kind is None:
            self._open()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; closing twice does nothing."""
        if self._file is not None:
            self._file.close()
            self._file = None
        self._waiting = []

    def on_event(self, event: Event) -> None:
        """Write one event; previews are left out."""
        payload = event.to_dict()
        if payload["kind"] in _PASSING:
            return
        self._write({"event": without_credentials(payload)})
        if self._file is None and payload["kind"] == self._from_kind:
            self._open()

    def on_picture(self, picture: Picture) -> None:
        """Write one picture."""
        data = base64.b64encode(picture.content).decode("ascii")
        self._write({"picture": {"name": picture.name, "caption": picture.caption, "format": FORMAT, "data": data}})

    def on_table(self, part: Mapping[str, Any]) -> None:
        """Write a part of the table in 3D (see `agent.reporting.table_model`)."""
        self._write({"table": part})

    def _write(self, entry: Mapping[str, Any]) -> None:
        line = encode_line({"seconds": round(time.perf_counter() - self._began, 3), **entry})
        if self._file is None:
            self._waiting.append(line)
        else:
            self._put(line)

    def _open(self) -> None:
        try:
            with self._folder() as place:
                self._file = self._replaced(place) if self._replace else self._continued(place)
        except BlockingIOError as error:
            raise UsageError(f"another process writes the session {str(self.path)!r}; choose another folder") from error
        except OSError as error:
            raise self._not_written(error) from error
        self._waiting = []

    @contextmanager
    def _folder(self) -> Iterator[OpenFolder]:
        """Open the file's folder, created if missing, and mark it as its owner's."""
        if self._owner is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with opened(self.path.parent) as place:
                yield place
        else:
            with own_folder(self.path.parent, self._owner) as place:
                mark(place, self._owner, files_written(place, self._owner) | {self.path.name})
                yield place

    def _continued(self, place: OpenFolder) -> Any:
        """Open and lock the file, and append the pending lines; a symbolic link is not followed."""
        descriptor = place.open(self.path.name, os.O_RDWR | os.O_APPEND | os.O_CREAT)
        file = os.fdopen(descriptor, "ab+", buffering=0)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            _write(file, (b"\n" if _is_torn(file, self.path) else b"") + b"".join(self._waiting))
        except BaseException:
            file.close()
            raise
        return file

    def _replaced(self, place: OpenFolder) -> Any:
        """Open and lock a new file with the pending lines, which replaces an earlier one."""
        with ExitStack() as until_replaced:
            if place.kind(self.path.name) == stat.S_IFREG:
                earlier = place.open(self.path.name, os.O_RDONLY)
                until_replaced.callback(os.close, earlier)
                fcntl.flock(earlier, fcntl.LOCK_EX | fcntl.LOCK_NB)
            file, unfinished = place.unfinished()
            try:
                _write(file, b"".join(self._waiting))
                place.replace(unfinished, self.path.name)
            except BaseException:
                file.close()
                place.remove(unfinished)
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
    """Open the session file of a run, `session.jsonl` in its report's folder; it replaces that of an earlier run.

    Args:
        folder: made, with the file, when the run has seen something; before that there is nothing worth a folder.
        options: of the run.
    """
    return SessionWriter(folder / RUN_SESSION, options, replace=True, from_kind="perceived", owner="run")


def _write(file: Any, content: bytes) -> None:
    """Write all of it at the end of an unbuffered file, or nothing."""
    size = os.fstat(file.fileno()).st_size
    try:
        while content:  # a system takes part of it where the disk is nearly full
            content = content[file.write(content) :]
    except OSError:
        with suppress(OSError):
            os.ftruncate(file.fileno(), size)  # half a line would make what follows it unreadable
        raise


def _is_torn(file: Any, path: Path) -> bool:
    """Return whether the last line of an open session is incomplete.

    Raises:
        UsageError: if the file is something else, which must not be written into.
    """
    file.seek(0)
    start = file.read(SESSION_START_BYTES).partition(b"\n")[0]
    if start and not is_start(decode_line(start)):
        raise UsageError(f"{str(path)!r} is there already, and is not a session, so it cannot be continued")
    file.seek(max(file.seek(0, os.SEEK_END) - 1, 0))
    return file.read(1) not in (b"", b"\n")
