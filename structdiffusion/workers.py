"""The same task for many jobs, in a pool of processes that each load what they need once."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Any

import torch

_loaded: Any = None  # what this worker process loaded, such as a planner or an object library


def in_parallel(
    task: Callable[[Any, Any], Any],
    load: Callable[..., Any],
    arguments: tuple[Any, ...],
    jobs: Sequence[Any],
    workers: int,
) -> Iterator[Any]:
    """`task(loaded, job)` for every job, in order, where `loaded = load(*arguments)`.

    With one worker everything happens in this process; with more, everything must pickle, each
    process loads once, and torch has one thread in each.
    """
    if workers <= 1:
        loaded = load(*arguments)
        yield from (task(loaded, job) for job in jobs)
        return
    # Spawned, not forked: torch and PyBullet do not survive a fork with their threads and clients.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, _load, (load, arguments)) as pool:
        yield from pool.map(partial(_work, task), jobs)


def _load(load: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    global _loaded
    torch.set_num_threads(1)
    _loaded = load(*arguments)


def _work(task: Callable[[Any, Any], Any], job: Any) -> Any:
    return task(_loaded, job)
