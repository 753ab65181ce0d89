"""Compute rows of an evaluation in processes on this machine or in workers of a Ray cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import Any

from agent.runtime.ray_cluster import ray_cluster
from structdiffusion.parallel import in_parallel


@dataclass(frozen=True)
class Workforce:
    """A number of processes on this machine (0 for this one alone), or workers of a Ray cluster."""

    count: int
    ray: bool

    def do(
        self, task: Callable[[Any, Any], Any], load: Callable[..., Any], arguments: tuple[Any, ...], jobs: Sequence[Any]
    ) -> Iterator[Any]:
        """Yield the results of all jobs as they finish, a `Lost` for each whose worker died; arguments as for
        `in_parallel`.
        """
        if not jobs:
            return
        with closing(in_parallel(task, load, arguments, jobs, self.count, ray=self.ray, ordered=False)) as results:
            yield from results


@contextmanager
def workforce(workers: int | None, ray: str | None) -> Iterator[Workforce]:
    """Provide `workers` workers, by default one per core, on this machine or on the Ray cluster at the address
    `ray`.
    """
    if ray is None:
        yield Workforce((os.cpu_count() or 1) if workers is None else workers, ray=False)
    else:
        with ray_cluster(ray, workers) as count:
            yield Workforce(count, ray=True)
