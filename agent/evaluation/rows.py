"""Compute the rows of an evaluation in workers, store them as they arrive, and resume a command that was stopped.

The row of a job whose worker died is marked as `LOST`, and the same command repeats it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from agent.evaluation.result_store import ResultStore, store_folder
from agent.runtime.progress import followed, progress
from agent.runtime.worker_pool import Workforce, workforce
from structdiffusion.benchmark.scenes import ANY_SHAPE
from structdiffusion.parallel import Lost, WorkerError

LOST = "lost"  # key of the reason in a row whose worker died
Row = dict[str, Any]
Place = tuple[str, int]  # a scene's structure and number
Result = TypeVar("Result")


def stored_scene_rows(
    compute: Callable[[Workforce, Sequence[Place]], Iterable[Row | Lost]],
    config: Mapping[str, Any],
    places: Sequence[Place],
    seed: int,
    *,
    what: str,
    files: Sequence[str],
    workers: int | None = None,
    out: Path | None = None,
) -> list[Row]:
    """Return a row for each scene, structure by structure: those stored in a folder, and the missing ones computed.

    Args:
        compute: yields the rows of some places as they finish; its lost jobs have a structure and a number.
        config: the `fingerprint` of the rows.
        places: the scenes; structures in turn, so that the rows of an evaluation that was stopped are of all of them.
        seed: of the scenes.
        what: the term for the rows in the progress, such as "scenes built".
        files: names of the other files that will be written to the folder.
        workers: processes; `None` for one per core, 0 for this process alone.
        out: folder that stores the rows; `None` stores nothing.

    Raises:
        UsageError, BadInput: as raised by `ResultStore`.
    """
    with (
        store_folder(out) as path,
        ResultStore(path, config, {"structure", "number"}, files) as store,
        workforce(workers, None) as force,
    ):
        rows = {(row["structure"], row["number"]): row for row in measured(store.rows)}
        missing = [place for place in places if place not in rows]
        results = compute(force, missing)  # may show a progress of its own before there are results
        computed = add_rows(
            store.add, results, lambda lost: lost_row((lost.job.structure, lost.job.number), seed, lost.reason),
            what, len(places), len(places) - len(missing),
        )  # fmt: skip
        rows |= {(row["structure"], row["number"]): row for row in computed}
    return [
        rows[place] for shape in dict.fromkeys(shape for shape, _ in places) for place in places if place[0] == shape
    ]


def add_rows(
    add: Callable[[Row], None],
    results: Iterable[Row | Lost],
    row_of: Callable[[Lost], Row],
    what: str,
    total: int,
    done: int = 0,
) -> list[Row]:
    """Store results as they finish, and show the progress.

    Args:
        add: stores a row.
        results: rows, and jobs whose worker died.
        row_of: returns the row of a lost job.
        what, total, done: as for `progress`.

    Returns:
        All rows in the order in which they finished.
    """
    rows = []
    with progress(what, total, done) as advance:
        for result in results:
            row = row_of(result) if isinstance(result, Lost) else result
            add(row)
            rows.append(row)
            advance(not isinstance(result, Lost) and LOST not in row)
    return rows


def lost_row(place: Place, seed: int, reason: str) -> Row:
    """Return the row of a scene whose worker died."""
    structure, number = place
    return {"structure": structure, "number": number, "seed": seed, LOST: reason}


def lost_scene_row(seed: int, lost: Lost) -> Row:
    """Return the row of a lost job, which is a scene or a pair of its structure, `None` for any, and its number."""
    job = lost.job
    structure, number = job if isinstance(job, tuple) else (job.structure, job.number)
    return lost_row((structure or ANY_SHAPE, number), seed, lost.reason)


def measured(rows: Iterable[Row]) -> list[Row]:
    """Return the rows whose worker did not die."""
    return [row for row in rows if LOST not in row]


def lost_count(rows: Sequence[Row]) -> int:
    """Count the rows whose worker died."""
    return len(rows) - len(measured(rows))


def collect(what: str, results: Iterable[Result | Lost], total: int) -> tuple[list[Result], list[Lost]]:
    """Collect results with a progress; separate the jobs whose worker died.

    Raises:
        WorkerError: if all jobs were lost.
    """
    found: list[Result] = []
    lost: list[Lost] = []
    for result in followed(what, results, total):
        if isinstance(result, Lost):
            lost.append(result)
        else:
            found.append(result)
    if lost and not found:
        raise WorkerError(f"nothing could be measured: every {lost[0].reason}")
    return found, lost
