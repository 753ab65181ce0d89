"""The folder of a batch: `results.jsonl`, a page, and `rows/ID` with report and session of what saw something.

`results.jsonl` is a journal while the batch works: one process appends a whole line for every row that ends, and forces
it to the disk; of two lines with one id the later holds. When all rows have ended it is replaced by one line per row in
the order of the file. A report is written under another name and moved into place before its row's line is appended, so
that a batch that is killed loses the rows at work, and nothing else. Reports of rows that the file no longer has stay.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from agent.journal import Journal, locked

RESULTS = "results.jsonl"
PAGE = "index.html"
ROWS = "rows"
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
        self._lock = locked(folder, "batch")
        self.folder, self.path, self._rows = folder, folder / RESULTS, folder / ROWS
        try:
            self._rows.mkdir(exist_ok=True)
            self._journal = Journal(self.path, _KEYS, "result of a batch")
        except BaseException:
            os.close(self._lock)
            raise
        self.by_id: dict[str, dict[str, Any]] = {result["id"]: result for result in self._journal.entries}
        self._sweep()

    def __enter__(self) -> Results:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Lets other batches into the folder."""
        self._sweep()
        self._journal.close()
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
        self.by_id[result["id"]] = result  # first, because Ctrl-C may come while the journal waits for the disk
        self._journal.add(result)

    def arrange(self, results: Sequence[dict[str, Any]]) -> None:
        """Replaces the journal by these results, at once."""
        self._journal.arrange(results)

    def write_page(self, page: str) -> None:
        """Replaces the folder's page (HTML), at once."""
        new = self.folder / f".{PAGE}"
        new.write_text(page, encoding="utf-8")
        new.replace(self.folder / PAGE)

    def _sweep(self) -> None:
        """Removes workplaces that nobody works in any more."""
        for path in self._rows.glob(".*"):
            shutil.rmtree(path, ignore_errors=True)
