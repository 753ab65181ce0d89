"""The folder of a batch: `results.jsonl`, and `rows/ID` with report and session of every row that saw something.

`results.jsonl` is a journal while the batch works: one process appends a whole line for every row that ends, and forces
it to the disk; of two lines with one id the later holds. When all rows have ended it is replaced by one line per row in
the order of the file. A report is written under another name and moved into place before its row's line is appended, so
that a batch that is killed loses the rows at work, and nothing else. Reports of rows that the file no longer has stay.
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from agent.errors import BadInput, UsageError

RESULTS = "results.jsonl"
ROWS = "rows"
_LOCK = ".lock"
# What makes a line one of ours.
_KEYS = {"id", "line", "fingerprint", "success", "exit_code", "report", "seconds"}


class Results:
    """The results in a folder, for one batch at a time. Close it, or use it as a context manager.

    Args:
        folder: made where it is not there; what a batch that was killed has left half done is cleaned up.

    Attributes:
        path: of the journal.
        by_id: row id -> the latest line, as a dictionary.

    Raises:
        UsageError: when the folder is a file, or another batch is at work in it.
        BadInput: when its `results.jsonl` is not one of a batch.
    """

    def __init__(self, folder: Path) -> None:
        if folder.exists() and not folder.is_dir():
            raise UsageError(f"--out must be a folder, and {str(folder)!r} is a file")
        self.folder, self.path, self._rows = folder, folder / RESULTS, folder / ROWS
        self._rows.mkdir(parents=True, exist_ok=True)
        self._lock = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(self._lock)
            message = f"another batch is at work in {str(folder)!r}; wait for it, or choose another --out"
            raise UsageError(message) from None
        try:
            self.by_id = self._recovered()
            self._sweep()
            self._journal = os.open(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
        except BaseException:
            os.close(self._lock)
            raise

    def __enter__(self) -> Results:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Lets other batches into the folder."""
        self._sweep()
        os.close(self._journal)
        os.close(self._lock)

    def workplace(self, row_id: str) -> Path:
        """Where the report of a row is written before it is moved into place; not there yet."""
        return self._rows / f".{row_id}"

    def has_report(self, result: dict[str, Any]) -> bool:
        """Whether the report that a result names is there, if it names one."""
        return result["report"] is None or (self.folder / result["report"]).is_file()

    def add(self, result: dict[str, Any]) -> None:
        """Moves what the row has left in its workplace into place, and keeps its result."""
        final, workplace = self._rows / result["id"], self.workplace(result["id"])
        shutil.rmtree(final, ignore_errors=True)
        if workplace.exists():
            workplace.rename(final)
        _write_all(self._journal, _line(result))
        os.fsync(self._journal)
        self.by_id[result["id"]] = result

    def arrange(self, results: Sequence[dict[str, Any]]) -> None:
        """Replaces the journal by these results, at once."""
        self._replace(b"".join(map(_line, results)))
        os.close(self._journal)
        self._journal = os.open(self.path, os.O_WRONLY | os.O_APPEND)

    def _recovered(self) -> dict[str, dict[str, Any]]:
        """What the journal holds; a last line that is torn is dropped."""
        try:
            content = self.path.read_bytes()
        except FileNotFoundError:
            return {}
        lines = content.split(b"\n")
        by_id, whole = {}, b""
        for number, line in enumerate(lines, start=1):
            result = _result(line)
            if result is not None:
                by_id[result["id"]] = result
                whole += line + b"\n"
            elif any(lines[number:]):
                raise BadInput(f"{str(self.path)!r}, line {number}: this is no result of a batch; choose another --out")
        if whole != content:
            self._replace(whole)
        return by_id

    def _replace(self, content: bytes) -> None:
        new = self.path.with_name(f".{RESULTS}")
        descriptor = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        try:
            _write_all(descriptor, content)
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        os.replace(new, self.path)
        folder = os.open(self.folder, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)

    def _sweep(self) -> None:
        """Removes workplaces that nobody works in any more."""
        for path in self._rows.glob(".*"):
            shutil.rmtree(path, ignore_errors=True)


def _line(result: dict[str, Any]) -> bytes:
    return json.dumps(result, ensure_ascii=False, allow_nan=False).encode() + b"\n"


def _result(line: bytes) -> dict[str, Any] | None:
    """The result in a line of a journal, or `None` where it has none."""
    try:
        result = json.loads(line)
    except ValueError:
        return None
    return result if isinstance(result, dict) and _KEYS <= result.keys() else None


def _write_all(descriptor: int, content: bytes) -> None:
    while content:
        content = content[os.write(descriptor, content) :]
