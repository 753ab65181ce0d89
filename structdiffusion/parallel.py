"""Run one task for many jobs in worker processes, on this machine or on a cluster; each worker loads its data once.

If a worker dies, its current job is returned as `Lost`, and another worker replaces it. Workers end with the process
that started them, however that process ends.
"""

from __future__ import annotations

import pickle
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from structdiffusion.temporary_folders import SHAPES
from structdiffusion.worker_process import ERROR, READY, WORKER_DIED, Work, Worker, WorkerProcess

# largest number of workers in a row that may die while loading: the next one would probably die as well
_MOST_DEATHS = 3


class WorkerError(RuntimeError):
    """Raised if workers died and results are missing; the message says which in one sentence."""


@dataclass(frozen=True)
class Lost:
    """Returned instead of a result if a worker died.

    Attributes:
        job: the job that was lost.
        reason: a few words, such as "worker died (SIGKILL)".
    """

    job: Any
    reason: str


def check_complete(lost: Sequence[Lost], count: int, what: str) -> None:
    """Refuse incomplete work.

    Args:
        lost: the missing pieces.
        count: the required number of pieces.
        what: plural noun of the pieces, such as "shards".

    Raises:
        WorkerError: if a piece is missing.
    """
    if lost:
        raise WorkerError(
            f"{len(lost)} of {count} {what} are missing ({lost[0].reason}); "
            "the same command again makes what is missing"
        )


def kept_pieces(
    worked: Iterable[Any], keep: Callable[[Any], None], done: int, count: int, what: str
) -> Iterator[tuple[int, int]]:
    """Keep each piece of work as it is finished; yield (pieces that are done, pieces in all), first before any.

    Args:
        worked: what `in_parallel` yields.
        keep: writes a piece.
        done: the pieces that were there before.
        count: the required number of pieces.
        what: plural noun of the pieces, such as "shards".

    Raises:
        WorkerError: at the end, if a piece is missing.
    """
    lost = []
    yield done, count
    for piece in worked:
        if isinstance(piece, Lost):
            lost.append(piece)
            continue
        keep(piece)
        done += 1
        yield done, count
    check_complete(lost, count, what)


def in_parallel(
    task: Callable[[Any, Any], Any],
    load: Callable[..., Any],
    arguments: tuple[Any, ...],
    jobs: Sequence[Any],
    workers: int,
    *,
    ray: bool = False,
    ordered: bool = True,
    threads: int | None = 1,
) -> Generator[Any, None, None]:
    """Yield `task(loaded, job)` for every job, with `loaded = load(*arguments)`; a `Lost` for each job whose worker
    died.

    With one thread of torch in each process, results are the same to the bit with any number of workers.

    Args:
        task: called for each job. Its exceptions are raised here, and end all other jobs.
        load: called once in each process.
        arguments: the arguments of `load`.
        jobs: with 0 workers of this machine, everything happens in this process; otherwise everything must pickle.
        workers: the number of processes; at most one per job is started.
        ray: run the workers as actors of the Ray cluster that this process is connected to.
        ordered: yield in the order of the jobs; otherwise as they end.
        threads: of torch in each process; `None` for as many as torch takes by itself.

    Raises:
        WorkerError: if no worker reaches its first job.
    """
    work = Work(task, load, arguments, threads)
    count = min(workers, len(jobs))
    if ray:
        ended = _by_actors(work, jobs, max(1, count))
    elif workers <= 0:
        ended = _here(work, jobs)
    else:
        ended = _by_processes(work, jobs, count)
    try:
        yield from _in_order(ended) if ordered else (result for _, result in ended)
    finally:
        ended.close()


def _in_order(ended: Iterator[tuple[int, Any]]) -> Iterator[Any]:
    early: dict[int, Any] = {}
    following = 0
    for number, result in ended:
        early[number] = result
        while following in early:
            yield early.pop(following)
            following += 1


def _here(work: Work, jobs: Sequence[Any]) -> Generator[tuple[int, Any], None, None]:
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(work.threads or before)
    try:
        loaded = work.load(*work.arguments)
        for number, job in enumerate(jobs):
            yield number, work.task(loaded, job)
    finally:
        torch.set_num_threads(before)


def _by_processes(work: Work, jobs: Sequence[Any], workers: int) -> Generator[tuple[int, Any], None, None]:
    # Pickled once, and unpickled by each worker itself: that imports much, and need not be waited for here.
    pickled = pickle.dumps(work)
    waiting, deaths = deque(enumerate(jobs)), 0
    processes: dict[Connection, WorkerProcess] = {}
    try:
        while waiting or any(process.job is not None for process in processes.values()):
            # Those that still load are as many as there are jobs for them.
            while len(processes) < workers and len(processes) < len(waiting) + _busy(processes):
                process = WorkerProcess(pickled)
                processes[process.pipe] = process
            for pipe in wait(list(processes)):
                process = processes[pipe]  # type: ignore[index]
                job, (said, content) = process.job, process.hear()
                if said == ERROR:
                    raise content
                deaths = 0 if said == READY else deaths + (said is None and job is None)
                if deaths >= _MOST_DEATHS:
                    raise WorkerError(f"{deaths} worker processes died in a row while they loaded ({content})")
                if said is not None and waiting:
                    process.give(*waiting.popleft())
                else:
                    del processes[process.pipe]
                    process.end()
                if job is not None:
                    yield job[0], Lost(job[1], content) if said is None else content
    finally:
        for process in processes.values():
            process.end()
        SHAPES.remove_abandoned()  # a process that was ended could not do so itself


def _busy(processes: dict[Connection, WorkerProcess]) -> int:
    return sum(process.job is not None for process in processes.values())


def _by_actors(work: Work, jobs: Sequence[Any], count: int) -> Generator[tuple[int, Any], None, None]:
    import ray

    make: Any = ray.remote(num_cpus=1)(Worker).remote
    waiting = deque(enumerate(jobs))
    busy: dict[Any, tuple[Any, int, Any]] = {}  # what is awaited -> who is at it, and at what
    idle = [make(work) for _ in range(count)]
    while waiting or busy:
        while waiting and idle:
            actor, (number, job) = idle.pop(), waiting.popleft()
            busy[actor.work.remote(job)] = actor, number, job
        (awaited, *_), _ = ray.wait(list(busy), num_returns=1)
        actor, number, job = busy.pop(awaited)
        try:
            result = ray.get(awaited)
        except ray.exceptions.RayTaskError:
            raise  # by the task itself
        except ray.exceptions.RayError as error:
            ray.kill(actor)  # where it is only out of order, it would keep the core that the next one needs
            actor, result = make(work), Lost(job, f"{WORKER_DIED} ({str(error).strip().splitlines()[0]})")
        idle.append(actor)
        yield number, result
