"""Carry out a batch: keep existing results, compute the other rows, and store each as it ends."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Generator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

from agent.batch.index_page import index_page
from agent.batch.results import PAGE, Results
from agent.batch.row_task import is_final, refused_result
from agent.batch.rows import BadRow, Row, read_rows
from agent.batch.summary import Summary, outcome_in_words
from agent.batch.workers import Job, run_locally, run_on_ray
from agent.pipeline.run import RunOptions
from agent.rendering.text import duration
from agent.runtime.progress import progress

_PAGE_SECONDS = 5.0  # between two versions of the page: of thousands of rows it takes a while to write


def run_batch(
    source: str,
    out: Path,
    defaults: RunOptions,
    workers: int | None,
    ray: str | None,
    retry: bool = False,
    force: bool = False,
) -> Summary:
    """Carry out every row of a file that has no final outcome yet.

    An outcome is final if the row succeeded, or failed and would fail in the same way again. Rows whose worker died, or
    that were interrupted, are repeated.

    Args:
        source: the file, or "-" for standard input.
        out: the folder; see `agent.batch.results`.
        defaults: the options of rows that do not give their own.
        workers: the number of processes, at most one per row; `None` for one per core.
        ray: the address of a Ray cluster to use, or `None` for processes on this machine.
        retry: repeat all rows that failed.
        force: accept a folder that contains other files.

    Raises:
        BadInput: if the file does not exist or has no rows, or the folder's results were not written by a batch.
        UsageError: for illegal options, a folder in use by another batch, or a cluster that does not answer.
    """
    rows = read_rows(source, defaults)
    with Results(out, force) as results:
        known = {row.id for row in rows if _is_known(row, results, retry)}
        bad = [row for row in rows if isinstance(row, BadRow) and row.id not in known]
        jobs = [Job(row, results.workplace(row.id)) for row in rows if isinstance(row, Row) and row.id not in known]
        count = len(bad) + len(jobs)
        print(_beginning(len(rows), count, [results.by_id[name] for name in known]), file=sys.stderr, flush=True)
        page = _Page(rows, results)
        try:
            for number, row in enumerate(bad, start=1):
                results.add(refused_result(row))
                print(f"{number} of {count}: {_line(refused_result(row))}", file=sys.stderr, flush=True)
            with closing(_ended(jobs, workers, ray)) as ended, progress("rows", count, len(bad), len(bad)) as advance:
                for result in ended:
                    results.add(result)
                    advance(result["success"], _line(result))
                    page.update()
            # A row may have moved to another line since its result was kept.
            ordered = [results.by_id[row.id] | {"line": row.line} for row in rows]
            results.arrange(ordered)
        finally:
            page.write()
    return Summary(ordered, len(known), results.path, results.folder / PAGE)


def _is_known(row: Row | BadRow, results: Results, retry: bool) -> bool:
    """Return whether the folder has the final result of a row."""
    result = results.by_id.get(row.id)
    if result is None or retry and not result["success"]:
        return False
    if isinstance(row, BadRow):
        return result == refused_result(row)
    return result["fingerprint"] == row.fingerprint and is_final(result) and results.has_report(result)


def _beginning(rows: int, to_do: int, known: Sequence[Mapping[str, Any]]) -> str:
    """Describe in a line how many results exist and how many rows remain."""
    succeeded = sum(result["success"] for result in known)
    failed = len(known) - succeeded
    said = [f"{succeeded} done before and kept"] if succeeded else []
    again = f"--retry tries {'it' if failed == 1 else 'them'} again"
    said += [f"{failed} failed before and kept ({again})"] if failed else []
    return f"{rows} row{'s' if rows > 1 else ''}: {', '.join([*said, f'{to_do} to do'])}"


def _line(result: Mapping[str, Any]) -> str:
    """Describe the outcome of a row in a line."""
    seconds = result["seconds"].get("total")
    return f"{result['id']} {outcome_in_words(result)}" + ("" if seconds is None else f", {duration(seconds)}")


def _ended(jobs: Sequence[Job], workers: int | None, ray: str | None) -> Generator[dict[str, Any], None, None]:
    """Yield the results of all rows as they end."""
    if not jobs:
        return
    if ray is not None:
        yield from run_on_ray(jobs, ray, workers)
    else:
        yield from run_locally(jobs, min(len(jobs), workers or os.cpu_count() or 1))


class _Page:
    """The page of the folder, written at intervals while the batch runs."""

    def __init__(self, rows: Sequence[Row | BadRow], results: Results) -> None:
        self._rows, self._results = rows, results
        self._written = time.monotonic()

    def update(self) -> None:
        """Write the page unless it was written a moment ago."""
        if time.monotonic() - self._written >= _PAGE_SECONDS:
            self.write()

    def write(self) -> None:
        """Write the page with all rows, finished or not."""
        by_id = self._results.by_id
        # The result of a row that has changed since is that of another row.
        ended = {row.id: by_id[row.id] for row in self._rows if _is_of(row, by_id.get(row.id))}
        self._results.write_page(index_page(self._rows, ended, self._results.folder))
        self._written = time.monotonic()


def _is_of(row: Row | BadRow, result: Mapping[str, Any] | None) -> bool:
    return result is not None and result["fingerprint"] == (row.fingerprint if isinstance(row, Row) else None)
