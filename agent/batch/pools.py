"""Who carries rows out: processes on this machine, or workers of a Ray cluster. Each loads what rows share once.

A worker that dies takes its row along, which is told as failed, and another takes its place. Workers end with the
process that started them, however that ends.
"""

from __future__ import annotations

import multiprocessing
import signal
import tempfile
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from agent.batch.rows import Row
from agent.batch.working import CRASHED, carry_out, failed
from agent.cluster import ray_cluster
from agent.loaded import Loaded
from agent.streams import import_pybullet_silently
from structdiffusion.workers import end_with_parent


@dataclass(frozen=True)
class Job:
    """A row, and the folder on this machine that gets its report."""

    row: Row
    folder: Path


def on_this_machine(jobs: Sequence[Job], workers: int) -> Iterator[dict[str, Any]]:
    """The results of all rows, as they end; each row in one of `workers` processes. Close it to stop them."""
    waiting = deque(jobs)
    busy: dict[Connection, _Process] = {}
    try:
        while waiting or busy:
            while waiting and len(busy) < workers:
                process = _Process()
                process.give(waiting.popleft())
                busy[process.pipe] = process
            for pipe in wait(list(busy)):
                process = busy[pipe]  # type: ignore[index]
                yield process.result()
                if process.alive and waiting:
                    process.give(waiting.popleft())
                else:
                    del busy[process.pipe]
                    process.end()
    finally:
        for process in busy.values():
            process.end()


class _Process:
    """A worker process and the row that it is at."""

    def __init__(self) -> None:
        # Spawned, not forked: torch and PyBullet do not survive a fork with their threads and clients.
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs,), daemon=True)
        # Ctrl-C reaches the whole terminal: what to do about it is for this process alone to decide.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        theirs.close()
        self.alive = True
        self._job: Job | None = None

    def give(self, job: Job) -> None:
        self._job = job
        try:
            self.pipe.send(job)
        except OSError:
            pass  # it has died: `result` finds that out

    def result(self) -> dict[str, Any]:
        """The result of its row, once the pipe has something to read; a failure where it died instead."""
        assert self._job is not None
        try:
            return self.pipe.recv()
        except (EOFError, OSError):
            self.alive = False
            self._process.join()
            return failed(self._job.row, CRASHED, "crash", f"its process died ({_death(self._process.exitcode)})")

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


def _serve(pipe: Connection) -> None:
    """The life of a worker process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
    import_pybullet_silently()
    loaded = Loaded()
    while True:
        try:
            job: Job = pipe.recv()
        except EOFError:
            return
        pipe.send(carry_out(job.row, job.folder, loaded))


def on_ray(jobs: Sequence[Job], address: str, workers: int | None) -> Iterator[dict[str, Any]]:
    """As `on_this_machine`, by workers of a Ray cluster, whose machines need structagent and the rows' files.

    Args:
        jobs: the rows.
        address, workers: as `ray_cluster` takes them.

    Raises:
        UsageError: when Ray is not installed, or no cluster answers at the address.
    """
    with ray_cluster(address, workers) as count:
        yield from _by_actors(jobs, min(len(jobs), count))


def _by_actors(jobs: Sequence[Job], count: int) -> Iterator[dict[str, Any]]:
    import ray

    make = ray.remote(num_cpus=1)(_RayWorker).remote
    waiting = deque(jobs)
    busy: dict[Any, tuple[Any, Job]] = {}  # what is awaited -> who is at it, and at what
    idle = [make() for _ in range(count)]
    while waiting or busy:
        while waiting and idle:
            actor, job = idle.pop(), waiting.popleft()
            busy[actor.carry_out.remote(job.row)] = actor, job
        ended, _ = ray.wait(list(busy), num_returns=1)
        for awaited in ended:
            actor, job = busy.pop(awaited)
            try:
                result, files = ray.get(awaited)
            except ray.exceptions.RayError as error:
                ray.kill(actor)  # where it is only out of order, it would keep the core that the next one needs
                actor = make()
                result, files = failed(job.row, CRASHED, "crash", f"its Ray worker died: {_first_line(error)}"), {}
            for name, content in files.items():
                job.folder.mkdir(exist_ok=True)
                (job.folder / name).write_bytes(content)
            idle.append(actor)
            yield result


class _RayWorker:
    """Carries rows out on any machine of a cluster; reports come back as bytes, because disks are not shared."""

    def __init__(self) -> None:
        import_pybullet_silently()
        self._loaded = Loaded()

    def carry_out(self, row: Row) -> tuple[dict[str, Any], dict[str, bytes]]:
        """The row's result, and its files: name -> content."""
        with tempfile.TemporaryDirectory() as folder:
            result = carry_out(row, Path(folder), self._loaded)
            return result, {path.name: path.read_bytes() for path in Path(folder).iterdir()}


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0]
