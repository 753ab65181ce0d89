"""The same task for many jobs, in processes that each load what they need once: of this machine, or of a cluster.

A worker that dies takes the job along that it was at, which comes back as `Lost`, and another worker takes its place.
Workers end with the process that started them, however that ends.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from structdiffusion.simulation.pybullet_import import import_pybullet_silently
from structdiffusion.temporary_folders import SHAPES

WORKER_DIED = "worker died"
_MOST_DEATHS = 3  # of workers in a row while they load: the next one would hardly fare better
_READY, _RESULT, _ERROR = "ready", "result", "error"  # what a worker process says


class WorkerError(RuntimeError):
    """Workers died and something is missing for it; the message says what in one sentence."""


@dataclass(frozen=True)
class Lost:
    """What comes instead of a result when a worker died.

    Attributes:
        job: what it was at.
        reason: a few words, such as "worker died (SIGKILL)".
    """

    job: Any
    reason: str


def check_complete(lost: Sequence[Lost], count: int, what: str) -> None:
    """Refuses work of which pieces are missing.

    Args:
        lost: the missing ones.
        count: how many there should be.
        what: they are called, as "shards".

    Raises:
        WorkerError: when there is one missing.
    """
    if lost:
        raise WorkerError(
            f"{len(lost)} of {count} {what} are missing ({lost[0].reason}); "
            "the same command again makes what is missing"
        )


@dataclass(frozen=True)
class _Work:
    """What a worker needs to know; see `in_parallel`."""

    task: Callable[[Any, Any], Any]
    load: Callable[..., Any]
    arguments: tuple[Any, ...]
    threads: int | None


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
) -> Iterator[Any]:
    """`task(loaded, job)` for every job, where `loaded = load(*arguments)`; a `Lost` where a worker died at it.

    With one thread of torch in each process, results are the same to the bit with any number of workers.

    Args:
        task: what is done for each job. What it raises is raised here, and ends the rest.
        load: called once in each process.
        arguments: what `load` is given.
        jobs: with 0 workers of this machine, everything happens in this process; otherwise everything must pickle.
        workers: how many processes; no more than jobs are started.
        ray: the workers are actors of the Ray cluster that this process is connected to.
        ordered: yield in the order of the jobs; otherwise as they end.
        threads: of torch in each process; `None` for as many as torch takes by itself.

    Raises:
        WorkerError: when no worker gets as far as its first job.
    """
    work = _Work(task, load, arguments, threads)
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


def _end_with_parent() -> None:
    """Lets this worker process end when the process that started it has ended, however that came."""
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _here(work: _Work, jobs: Sequence[Any]) -> Iterator[tuple[int, Any]]:
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(work.threads or before)
    try:
        loaded = work.load(*work.arguments)
        for number, job in enumerate(jobs):
            yield number, work.task(loaded, job)
    finally:
        torch.set_num_threads(before)


def _by_processes(work: _Work, jobs: Sequence[Any], workers: int) -> Iterator[tuple[int, Any]]:
    # Pickled once, and unpickled by each worker itself: that imports much, and need not be waited for here.
    pickled = pickle.dumps(work)
    waiting, deaths = deque(enumerate(jobs)), 0
    processes: dict[Connection, _Process] = {}
    try:
        while waiting or any(process.job is not None for process in processes.values()):
            # Those that still load are as many as there are jobs for them.
            while len(processes) < workers and len(processes) < len(waiting) + _busy(processes):
                process = _Process(pickled)
                processes[process.pipe] = process
            for pipe in wait(list(processes)):
                process = processes[pipe]  # type: ignore[index]
                job, (said, content) = process.job, process.hear()
                if said == _ERROR:
                    raise content
                deaths = 0 if said == _READY else deaths + (said is None and job is None)
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


def _busy(processes: dict[Connection, _Process]) -> int:
    return sum(process.job is not None for process in processes.values())


def _context() -> multiprocessing.context.BaseContext:
    """Return the way in which workers are started: forked off a server process that has imported the libraries.

    Not forked off this process: torch and PyBullet do not survive that with their threads and clients. The server has
    none of either, and importing takes longer (2.5 s) than most jobs.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():  # Windows
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["structdiffusion.parallel_imports"])
    return context


class _Process:
    """A worker process, for pickled `_Work`.

    Attributes:
        pipe: has something to read when it has said something, or died.
        job: number and content of what it is at; `None` while it loads.
    """

    def __init__(self, work: bytes) -> None:
        context = _context()
        self.pipe, theirs = context.Pipe()
        self.job: tuple[int, Any] | None = None
        self._process = context.Process(target=_serve, args=(theirs, work), daemon=True)
        # Ctrl-C reaches the whole terminal: what to do about it is for this process alone to decide.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        theirs.close()

    def give(self, number: int, job: Any) -> None:
        self.job = number, job
        try:
            self.pipe.send(job)
        except OSError:
            pass  # it has died: `hear` finds that out

    def hear(self) -> tuple[str | None, Any]:
        """What it says, once the pipe has something to read; `None` and the reason where it died instead."""
        try:
            return self.pipe.recv()
        except (EOFError, OSError):
            self._process.join()
            return None, f"{WORKER_DIED} ({_death(self._process.exitcode)})"

    def end(self) -> None:
        self._process.kill()  # it has nothing to save
        self._process.join()
        self.pipe.close()


def _death(exit_code: int | None) -> str:
    if exit_code is None or exit_code >= 0:
        return f"exit code {exit_code}"
    try:
        return signal.Signals(-exit_code).name
    except ValueError:
        return f"signal {-exit_code}"


def _serve(pipe: Connection, work: bytes) -> None:
    """The life of a worker process, which is given a pickled `_Work`."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _end_with_parent()
    try:
        import_pybullet_silently()
        worker = _Worker(pickle.loads(work))
        pipe.send((_READY, None))
        while True:
            pipe.send((_RESULT, worker.work(pipe.recv())))
    except EOFError:
        return
    except Exception as error:
        with suppress(OSError):  # nobody is there any more to hear of it
            pipe.send((_ERROR, _portable(error)))


def _portable(error: Exception) -> Exception:
    """The error as another process can have it, with the traceback as a note."""
    told = "".join(traceback.format_exception(error))
    try:
        error = pickle.loads(pickle.dumps(error))
    except Exception:  # its constructor takes something else than its message
        error = RuntimeError(f"{type(error).__name__}: {error}")
    error.add_note(f"in a worker:\n{told}")
    return error


class _Worker:
    """What every worker does, whether it is a process here or an actor of a Ray cluster."""

    def __init__(self, work: _Work) -> None:
        if work.threads is not None:
            import torch

            torch.set_num_threads(work.threads)
        self._task, self._loaded = work.task, work.load(*work.arguments)

    def work(self, job: Any) -> Any:
        return self._task(self._loaded, job)


def _by_actors(work: _Work, jobs: Sequence[Any], count: int) -> Iterator[tuple[int, Any]]:
    import ray

    make = ray.remote(num_cpus=1)(_Worker).remote
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
