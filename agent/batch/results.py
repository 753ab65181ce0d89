"""Store the results of a batch: `results.jsonl`, a page, and `rows/ID` with report and session of rows that saw a
scene.

Only an empty folder or one made by a batch is accepted, unless forced (`agent.runtime.output_ownership`). In `rows/ID`
only files that a batch wrote are replaced; other files beside them stay.

`results.jsonl` is a journal while the batch works: one process appends a whole line for every row that ends, and forces
it to the disk; of two lines with one id the later holds. When all rows have ended it is replaced by one line per row in
the order of the file. A report is written under another name and moved into place before its row's line is appended, so
that a batch that is killed loses the rows at work, and nothing else. Reports of rows that the file no longer has stay.
"""

from __future__ import annotations

import codecs
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from agent.batch.result_schema import REPORT, ROWS, result_error
from agent.errors import BadInput
from agent.runtime.jsonl_journal import Journal, entry_of, locked_folder
from agent.runtime.output_ownership import (
    MARKER,
    check_opened,
    check_subfolder,
    claim_folder,
    files_written,
    mark,
    remove_written,
)
from grounding.atomic_files import OpenFolder, opened

RESULTS = "results.jsonl"
PAGE = "index.html"
_WORK = ".structagent-work-"  # begins the name of the folder in which rows are at work
_WORKPLACE = re.compile(re.escape(_WORK) + r"[a-z0-9_]{8}")
_NAMES = ("report.html", "report.json", "session.jsonl", "traceback.txt")  # that a row leaves, beside pictures
_KEYS = {"id", "line", "fingerprint", "success", "exit_code", "report", "seconds"}  # make a line one of ours


class Results:
    """The results in a folder, for one batch at a time. Close it, or use it as a context manager.

    Args:
        folder: the folder, created if missing; unfinished output of a batch that was killed is removed.
        force: accept a folder that contains other files.

    Attributes:
        path: the path of the journal.
        by_id: row id -> the latest line, as a dictionary.

    Raises:
        UsageError: if the folder is a file, is in use by another batch, or contains files that no batch wrote.
        BadInput: if its `results.jsonl` was not written by a batch.
    """

    def __init__(self, folder: Path, force: bool = False) -> None:
        self.folder, self.path, self._rows = folder, folder / RESULTS, folder / ROWS
        _check_results(self.path)
        claim_folder(folder, "batch", force)
        with ExitStack() as until_open:
            self._place = until_open.enter_context(locked_folder(folder, "batch"))
            check_opened(self._place, "batch")
            mark(self._place, "batch", (RESULTS, PAGE))  # first: what is killed behind this can be resumed
            check_subfolder(self._rows)
            self._rows.mkdir(exist_ok=True)
            self._rows_place = until_open.enter_context(opened(Path(ROWS), self._place))
            self._journal = Journal(self._place, RESULTS, _KEYS, "result of a batch", result_error)
            until_open.callback(lambda: self._journal.close())
            for sentence in self._journal.left_out:
                print(f"structagent: {sentence}; the row is carried out again", file=sys.stderr, flush=True)
            self._sweep()
            self._work = Path(tempfile.mkdtemp(prefix=_WORK, dir=folder))
            until_open.callback(shutil.rmtree, self._work, ignore_errors=True)
            self._work_place = until_open.enter_context(opened(Path(self._work.name), self._place))
            self._open = until_open.pop_all()
        self.by_id: dict[str, dict[str, Any]] = {result["id"]: result for result in self._journal.entries}

    def __enter__(self) -> Results:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Unlock the folder for other batches."""
        self._open.close()

    def workplace(self, row_id: str) -> Path:
        """Return the path at which the report of a row is written before it is moved into place; it does not exist yet.

        Raises:
            BadInput: if the row's folder is not a folder, or has files under the names of report files that no batch
                wrote.
        """
        final = self._rows / row_id
        check_subfolder(final)
        if final.exists():
            with opened(Path(row_id), self._rows_place) as place:
                foreign = set(place.names()) - files_written(place, "run")
            if taken := sorted(name for name in foreign if name in _NAMES):
                raise BadInput(
                    f"{str(final / taken[0])!r} exists and was not written by a batch; choose another --out, or move "
                    "it away"
                )
        return self._work / row_id

    def has_report(self, result: dict[str, Any]) -> bool:
        """Return whether the report of a result exists; true if it has none."""
        return result["report"] is None or (self._rows / result["id"] / REPORT).is_file()

    def add(self, result: dict[str, Any]) -> None:
        """Move the files of a row into place and store its result."""
        name = result["id"]
        check_subfolder(self._rows / name)
        self._clear(name)
        if self._work_place.kind(name) is not None:
            with opened(Path(name), self._work_place) as workplace:
                mark(workplace, "run", set(workplace.names()) - {MARKER})
                self._move(workplace, name)
        self.by_id[result["id"]] = result  # first, because Ctrl-C may come while the journal waits for the disk
        self._journal.add(result)

    def arrange(self, results: Sequence[dict[str, Any]]) -> None:
        """Replace the journal with these results in one step."""
        self._journal.arrange(results)

    def write_page(self, page: str) -> None:
        """Replace the folder's page (HTML) in one step."""
        self._place.write({PAGE: page})

    def _clear(self, name: str) -> None:
        """Remove the files that a batch wrote into a row's folder, and the folder if it is empty then."""
        if self._rows_place.kind(name) is None:
            return
        with opened(Path(name), self._rows_place) as final:
            remove_written(final, "run")
            if final.names() == [MARKER]:
                final.remove(MARKER)
        with suppress(OSError):
            os.rmdir(name, dir_fd=self._rows_place.descriptor)

    def _move(self, workplace: OpenFolder, name: str) -> None:
        """Move a row's temporary folder into place; if other files remain in the row's folder, move only its files."""
        if self._rows_place.kind(name) is None:
            self._work_place.replace(name, name, self._rows_place)
            return
        with opened(Path(name), self._rows_place) as final:
            for file in sorted(workplace.names()):
                workplace.replace(file, file, final)
        os.rmdir(name, dir_fd=self._work_place.descriptor)

    def _sweep(self) -> None:
        """Remove the temporary folders of batches that were killed."""
        for path in self.folder.glob(f"{_WORK}*"):
            if _WORKPLACE.fullmatch(path.name) and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)


def _check_results(path: Path) -> None:
    """Refuse an invalid results file before anything is written beside it.

    Raises:
        BadInput: if it is not the results of a batch, or is a symbolic link.
    """
    if not os.path.lexists(path):
        return
    if path.is_symlink() or not path.is_file():
        raise BadInput(f"{str(path)!r} must be a file with the results of a batch; choose another --out")
    with path.open("rb") as file:
        first = file.readline().removeprefix(codecs.BOM_UTF8)
        # A line of ours that somebody has edited is named later, and costs no other.
        if first.endswith(b"\n") and all(entry_of(line, _KEYS) is None for line in (first, *file)):
            raise BadInput(f"{str(path)!r}, line 1: this is not a result of a batch; choose another --out")
