"""Carry out rows in processes on this machine or in workers of a Ray cluster; each loads shared models once.

When a worker dies, its row counts as failed, and another worker takes its place.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agent.batch.row_task import carry_out, lost_result
from agent.batch.rows import Row
from agent.pipeline.resources import ResourceCache
from agent.runtime.ray_cluster import ray_cluster
from grounding.atomic_files import write_whole
from structdiffusion.parallel import Lost, in_parallel


@dataclass(frozen=True)
class Job:
    """A row, and the folder on this machine for its report."""

    row: Row
    folder: Path


def run_locally(jobs: Sequence[Job], workers: int) -> Iterator[dict[str, Any]]:
    """Carry out the rows in `workers` processes and yield the results as they finish;
    close the generator to stop them.
    """
    with closing(in_parallel(_carried_out, ResourceCache, (), jobs, workers, ordered=False, threads=None)) as ended:
        for result in ended:
            yield lost_result(result.job.row, result.reason) if isinstance(result, Lost) else result


def run_on_ray(jobs: Sequence[Job], address: str, workers: int | None) -> Iterator[dict[str, Any]]:
    """Carry out the rows as `run_locally` does, in workers of a Ray cluster whose machines have structagent and the
    files of the rows.

    Args:
        jobs: the rows.
        address, workers: as for `ray_cluster`.

    Raises:
        UsageError: if Ray is not installed, or no cluster answers at the address.
    """
    with ray_cluster(address, workers) as count:
        ended = in_parallel(_carried_out_there, ResourceCache, (), jobs, count, ray=True, ordered=False, threads=None)
        for result in ended:
            if isinstance(result, Lost):
                yield lost_result(result.job.row, result.reason)
                continue
            job, row_result, files = result
            for name, content in files.items():
                write_whole(job.folder / Path(name).name, content)
            yield row_result


def _carried_out(cache: ResourceCache, job: Job) -> dict[str, Any]:
    return carry_out(job.row, job.folder, cache)


def _carried_out_there(cache: ResourceCache, job: Job) -> tuple[Job, dict[str, Any], dict[str, bytes]]:
    """Return the job, the result of its row, and its files (name -> bytes), because disks are not shared."""
    with tempfile.TemporaryDirectory() as folder:
        result = carry_out(job.row, Path(folder), cache)
        return job, result, {path.name: path.read_bytes() for path in Path(folder).iterdir()}
