"""Segment labelled clouds or synthetic tables, and report how well, per class: `structagent evaluate segmentation`."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np

import agent.perception
from agent.errors import BadInput
from agent.evaluation.report import (
    command_line,
    interval,
    left_out_note,
    percent,
    print_footer,
    print_table,
    rate_of,
    report_frame,
)
from agent.evaluation.rows import LOST, Row, collect
from agent.evaluation.segmentation.labelled_clouds import LabelledCloud, labelled_files, read_labelled
from agent.evaluation.segmentation.scores import scores_of
from agent.evaluation.segmentation.synthetic_tables import synthetic_table
from agent.perception.arbitration import DEFAULT
from agent.perception.segmentation import segment
from agent.recordings.recording import DepthFrame, Recording
from agent.synthetic_tables.arrangements import ARRANGEMENTS
from structdiffusion.parallel import in_parallel

_ALL = "all"
_COUNTS = ("split", "swallowed", "missed", "phantoms")
# A file; or the class, part, seed and number of a synthetic table, and whether its objects have prints.
Job = Path | tuple[str, str, int, int, bool]


def measure_segmentation(
    data: Path | None, part: str, count: int, seed: int, workers: int, method: str = DEFAULT, printed: bool = False
) -> Row:
    """Segment every cloud and compare it with its truth; return a JSON-ready report with a row for each.

    Args:
        data: folder of labelled clouds; `None` for synthetic tables.
        part: "development" or "test" objects of synthetic tables.
        count: synthetic tables of each class.
        seed: of the synthetic tables.
        workers: processes.
        method: who tells objects apart, one of `METHODS`.
        printed: whether the objects of synthetic tables have prints.

    Raises:
        BadInput: when the folder holds no labelled cloud, or one is damaged.
    """
    jobs: list[Job]
    if data is not None:
        files = labelled_files(data)
        jobs = list(files)
        read_labelled(files[0])  # a folder of other clouds is reported before any worker starts
        command = command_line("segmentation", data=data, method=method)
    else:
        jobs = [(kind, part, seed, number, printed) for kind in ARRANGEMENTS for number in range(count)]
        command = command_line("segmentation", part=part, scenes=count, seed=seed, method=method, printed=printed)
    rows, lost = collect("clouds segmented", in_parallel(_compare, str, (method,), jobs, workers), len(jobs))
    frame = report_frame(command, len(rows), None if data is not None else seed, (agent.perception,))
    kinds = list(dict.fromkeys(row["class"] for row in rows))
    aggregate = {kind: _rates([row for row in rows if kind in (_ALL, row["class"])]) for kind in (*kinds, _ALL)}
    return {
        **frame,
        "method": method,
        "rows": rows,
        "aggregate": aggregate,
        LOST: [{"job": str(one.job), LOST: one.reason} for one in lost],
    }


def print_segmentation(report: dict[str, Any], results: TextIO) -> None:
    """Print the table: a row per class."""
    head = ["class", "n", "objects", "count right", "exact", "95 %", "overlap F", "boundary F", *_COUNTS, "seconds"]
    table = [head]
    for kind, rates in report["aggregate"].items():
        cells = [kind, str(rates["exact"]["n"]), str(rates["objects"]), str(rates["count_right"]["count"])]
        cells += [str(rates["exact"]["count"]), interval(rates["exact"])]
        cells += [percent(rates["overlap_f"], 1), percent(rates["boundary_f"], 1)]
        cells += [str(rates[key]) for key in _COUNTS]
        table.append([*cells, f"{rates['seconds']:.2f}"])
    print_table(table, results)
    print_footer(report, results, left_out_note(len(report[LOST])))


def segmented(cloud: LabelledCloud, method: str = DEFAULT) -> np.ndarray:
    """Return what perception finds in a cloud: labels (H, W), objects from 1 on; none where no table is found."""
    recording = Recording(Path(cloud.name), DepthFrame(cloud.points, cloud.color))
    try:
        return segment(recording, method).labels
    except BadInput:
        return np.zeros(cloud.labels.shape, dtype=np.int16)


def _compare(method: str, job: Job) -> Row:
    """Segment one cloud; return its row."""
    cloud = read_labelled(job) if isinstance(job, Path) else synthetic_table(*job)
    began = time.perf_counter()
    labels = segmented(cloud, method)
    seconds = round(time.perf_counter() - began, 3)
    labels = np.where(np.isfinite(cloud.points).all(axis=-1), labels, 0)
    row: Row = {"name": cloud.name, "class": cloud.kind, "sensor": cloud.sensor}
    return row | scores_of(labels, cloud.labels).to_dict() | {"seconds": seconds}


def _rates(rows: Sequence[Row]) -> Row:
    return {
        "objects": sum(row["objects"] for row in rows),
        "count_right": rate_of([row["found"] == row["objects"] for row in rows]),
        "exact": rate_of([row["exact"] for row in rows]),
        "overlap_f": float(np.mean([row["overlap"][2] for row in rows])),
        "boundary_f": float(np.mean([row["boundary"][2] for row in rows])),
        "seconds": float(np.mean([row["seconds"] for row in rows])),
        **{key: sum(row[key] for row in rows) for key in _COUNTS},
    }
