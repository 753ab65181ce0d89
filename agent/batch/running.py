"""A batch from its file to its folder: what is there already is kept, the rest is carried out and kept as it ends."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

from agent.batch.pools import Job, on_ray, on_this_machine
from agent.batch.results import Results
from agent.batch.rows import BadRow, Row, read_rows
from agent.batch.summary import Summary
from agent.batch.working import refused
from agent.pipeline import RunOptions
from agent.progress import progress


def run_batch(source: str, out: Path, defaults: RunOptions, workers: int | None, ray: str | None) -> Summary:
    """Carries out every row of a file that has no successful result in the folder yet; failed rows are tried again.

    Args:
        source: the file, or "-" for standard input.
        out: the folder; see `agent.batch.results`.
        defaults: the options of a row that gives none.
        workers: how many processes, never more than rows; `None` for one per core.
        ray: the address of a Ray cluster whose workers do it, or `None` for processes of this machine.

    Raises:
        BadInput: when there is no such file, it has no rows, or the folder's results are not those of a batch.
        UsageError: for options that are not legal, a folder in which another batch is at work, or a cluster that does
            not answer.
    """
    rows = read_rows(source, defaults)
    with Results(out) as results:
        kept = [row for row in rows if isinstance(row, Row) and _is_done(row, results)]
        bad = [row for row in rows if isinstance(row, BadRow)]
        jobs = [Job(row, results.workplace(row.id)) for row in rows if isinstance(row, Row) and row not in kept]
        for row in bad:
            if results.by_id.get(row.id) != refused(row):
                results.add(refused(row))
        count, refusals = len(rows) - len(kept), len(bad)
        with closing(_pool(jobs, workers, ray)) as ended, progress("rows", count, refusals, refusals) as tell:
            for result in ended:
                results.add(result)
                tell(result["success"])
        # A row may have moved to another line since its result was kept.
        ordered = [results.by_id[row.id] | {"line": row.line} for row in rows]
        results.arrange(ordered)
    return Summary(ordered, len(kept), results.path)


def _is_done(row: Row, results: Results) -> bool:
    result = results.by_id.get(row.id)
    if result is None or not result["success"] or result["fingerprint"] != row.fingerprint:
        return False
    return results.has_report(result)


def _pool(jobs: Sequence[Job], workers: int | None, ray: str | None) -> Iterator[dict[str, Any]]:
    if not jobs:
        return iter(())
    if ray is not None:
        return on_ray(jobs, ray, workers)
    return on_this_machine(jobs, min(len(jobs), workers or os.cpu_count() or 1))
