"""The same task for many jobs, in processes that each load what they need once: of this machine, or of a cluster."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from typing import Any

_loaded: Any = None  # what this worker process loaded, such as a planner or an object library


class WorkerError(RuntimeError):
    """A worker that died at its job; the message says so in one sentence."""


def in_parallel(
    task: Callable[[Any, Any], Any],
    load: Callable[..., Any],
    arguments: tuple[Any, ...],
    jobs: Sequence[Any],
    workers: int,
    *,
    ray: bool = False,
    ordered: bool = True,
) -> Iterator[Any]:
    """`task(loaded, job)` for every job, where `loaded = load(*arguments)`.

    Torch has one thread in each process, so that results are the same to the bit with any number of workers.

    Args:
        task: what is done for each job.
        load: called once in each process.
        arguments: what `load` is given.
        jobs: with one worker of this machine, everything happens in this process; otherwise everything must pickle.
        workers: how many processes.
        ray: the workers are actors of the Ray cluster that this process is connected to.
        ordered: yield in the order of the jobs; otherwise as they end.

    Raises:
        WorkerError: when a worker dies.
    """
    if ray:
        yield from _by_actors(task, load, arguments, jobs, workers, ordered)
    elif workers <= 1:
        yield from _here(task, load, arguments, jobs)
    else:
        yield from _by_processes(task, load, arguments, jobs, workers, ordered)


def end_with_parent() -> None:
    """Lets this worker process end when the process that started it has ended, however that came."""
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _here(
    task: Callable[[Any, Any], Any], load: Callable[..., Any], arguments: tuple[Any, ...], jobs: Sequence[Any]
) -> Iterator[Any]:
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        loaded = load(*arguments)
        yield from (task(loaded, job) for job in jobs)
    finally:
        torch.set_num_threads(threads)


def _by_processes(
    task: Callable[[Any, Any], Any],
    load: Callable[..., Any],
    arguments: tuple[Any, ...],
    jobs: Sequence[Any],
    workers: int,
    ordered: bool,
) -> Iterator[Any]:
    # Spawned, not forked: torch and PyBullet do not survive a fork with their threads and clients.
    context = multiprocessing.get_context("spawn")
    others = set(multiprocessing.active_children())
    with ProcessPoolExecutor(workers, context, _load, (load, arguments)) as pool:
        futures = [pool.submit(partial(_work, task), job) for job in jobs]
        try:
            for future in futures if ordered else as_completed(futures):
                yield future.result()
        except BrokenProcessPool as error:
            raise WorkerError(f"one of {workers} worker processes died, perhaps for want of memory") from error
        except BaseException:  # Ctrl-C, or nobody wants the rest: what the workers are at is not waited for
            for worker in set(multiprocessing.active_children()) - others:
                worker.kill()
            raise


def _load(load: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    global _loaded
    import torch

    # Ctrl-C reaches the whole terminal: what to do about it is for the process that started this one to decide.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
    torch.set_num_threads(1)
    _loaded = load(*arguments)


def _work(task: Callable[[Any, Any], Any], job: Any) -> Any:
    return task(_loaded, job)


def _by_actors(
    task: Callable[[Any, Any], Any],
    load: Callable[..., Any],
    arguments: tuple[Any, ...],
    jobs: Sequence[Any],
    workers: int,
    ordered: bool,
) -> Iterator[Any]:
    import ray
    from ray.util import ActorPool

    actor = ray.remote(num_cpus=1)(_Actor)
    pool = ActorPool([actor.remote(load, arguments) for _ in range(min(workers, max(1, len(jobs))))])
    run = pool.map if ordered else pool.map_unordered
    try:
        yield from run(lambda worker, job: worker.work.remote(task, job), list(jobs))
    except ray.exceptions.RayActorError as error:
        raise WorkerError(f"one of {workers} Ray workers died, perhaps for want of memory") from error


class _Actor:
    """A worker of a Ray cluster."""

    def __init__(self, load: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        import torch

        torch.set_num_threads(1)
        self._loaded = load(*arguments)

    def work(self, task: Callable[[Any, Any], Any], job: Any) -> Any:
        return task(self._loaded, job)
