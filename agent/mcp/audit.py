"""Write the audit log: one JSON line for every tool call, and one more before the arm moves.

| key | value |
|---|---|
| `time` | when the line was written, UTC; never before that of an earlier line of this server |
| `clock` | only if the clock was set back: what it shows |
| `client` | the client's name and version, as it gave them |
| `tool`, `arguments` | what was called; long texts are shortened |
| `decision` | who allowed it: "not needed", "asked", "approved", "approved by --approve-all", "declined", "dismissed" |
| `outcome` | "started", "done", "cancelled", "refused: ..." or "defect: ..." |
| `seconds` | since the call came |
"""

from __future__ import annotations

import json
import os
import reprlib
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from threading import Lock
from typing import Any, Self

from agent.errors import NotWritten

NOT_NEEDED, ASKED, APPROVED, DECLINED, DISMISSED = "not needed", "asked", "approved", "declined", "dismissed"
APPROVED_ALL = "approved by --approve-all"
STARTED, DONE, CANCELLED = "started", "done", "cancelled"
_LONGEST_TEXT = 300  # characters of one argument
_MOST_ARGUMENTS = 20


class AuditLog:
    """The audit log of a server; use it in a `with` block.

    Args:
        path: the file; lines are appended to one that exists. A symbolic link is not followed.

    Raises:
        NotWritten: if it cannot be written, also later.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock, self._latest = Lock(), ""
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW, 0o600)
        except OSError as error:
            raise self._not_written(error) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)

    def write(self, entry: Mapping[str, Any]) -> None:
        """Append one line."""
        with self._lock:
            now = datetime.now(UTC).isoformat(timespec="milliseconds")
            self._latest = max(now, self._latest)
            set_back = {"clock": now} if now < self._latest else {}
            line = {"time": self._latest, **set_back, **entry}
            content = json.dumps(line, ensure_ascii=True, allow_nan=False).encode() + b"\n"
            try:
                while content:
                    content = content[os.write(self._file, content) :]
            except OSError as error:
                raise self._not_written(error) from error

    def _not_written(self, error: OSError) -> NotWritten:
        return NotWritten(f"cannot write the audit log {str(self.path)!r}: {error.strerror}")


class AuditedCall:
    """One call of a tool, from its arrival to its outcome.

    Args:
        log: the log.
        client: the client's name and version.
        tool: the name of the tool.
        arguments: as the client gave them.

    Attributes:
        decision: who allowed it, so far.
    """

    def __init__(self, log: AuditLog, client: str, tool: str, arguments: Mapping[str, Any]) -> None:
        self._log, self._began = log, time.perf_counter()
        given = [(_short(str(name)), _short(value)) for name, value in arguments.items()]
        self._call = {"client": _short(client), "tool": _short(tool), "arguments": dict(given[:_MOST_ARGUMENTS])}
        self.decision = NOT_NEEDED

    def write(self, outcome: str) -> None:
        """Write what became of it so far.

        Raises:
            NotWritten: if the log cannot be written.
        """
        seconds = round(time.perf_counter() - self._began, 3)
        self._log.write({**self._call, "decision": self.decision, "outcome": _short(outcome), "seconds": seconds})


def _short(value: Any) -> Any:
    """Return a value that fits on a line: numbers and booleans as they are, anything else as short text."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int) and abs(value) < 2**63:
        return value
    text = value if isinstance(value, str) else reprlib.repr(value)
    return text if len(text) <= _LONGEST_TEXT else f"{text[:_LONGEST_TEXT]}... ({len(text)} characters)"
