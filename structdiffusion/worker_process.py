"""A worker process: the process that needs its results starts it, sends it jobs and receives its results."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import shutil
import signal
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext, SpawnContext
from multiprocessing.util import get_temp_dir
from typing import Any

from structdiffusion.simulation.pybullet_import import import_pybullet_silently

WORKER_DIED = "worker died"
_ENDING = {signal.SIGTERM, signal.SIGHUP}
READY, RESULT, ERROR = "ready", "result", "error"  # what a worker process says


@dataclass(frozen=True)
class Work:
    """The inputs of a worker; see `in_parallel`."""

    task: Callable[[Any, Any], Any]
    load: Callable[..., Any]
    arguments: tuple[Any, ...]
    threads: int | None


def worker_context() -> ForkServerContext | SpawnContext:
    """Return the start method of workers: forked from a server process that has imported the libraries.

    Not forked off this process: torch and PyBullet do not survive that with their threads and clients. The server has
    none of either, and importing takes longer (2.5 s) than most jobs.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():  # Windows
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["structdiffusion.parallel_imports"])
    return context


@contextmanager
def safe_path() -> Iterator[None]:
    """Let Python processes that start meanwhile import nothing from the current folder, which may be untrusted."""
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["PYTHONSAFEPATH"]
        else:
            os.environ["PYTHONSAFEPATH"] = before


@contextmanager
def without_interruptions() -> Iterator[None]:
    """Let processes that start meanwhile never be interrupted, and this one be interrupted or ended afterwards.

    Ctrl-C reaches the whole terminal: what to do about it is for this process alone to decide. A process that gets only
    half of its work ends with a traceback.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    # Starting the tracker ends with allowing interruptions again, so it must run before a server is started.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, *_ENDING})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class WorkerProcess:
    """A worker process, for pickled `Work`.

    Attributes:
        pipe: readable when it has sent a message or died.
        job: number and content of its present job; `None` while it loads.
    """

    def __init__(self, work: bytes) -> None:
        context = worker_context()
        self.pipe, theirs = context.Pipe()
        self.job: tuple[int, Any] | None = None
        self._process = context.Process(target=_serve, args=(theirs, work, get_temp_dir()), daemon=True)
        with safe_path(), without_interruptions():
            self._process.start()
        theirs.close()

    def give(self, number: int, job: Any) -> None:
        self.job = number, job
        with suppress(OSError):  # it has died: `hear` detects that
            self.pipe.send(job)

    def hear(self) -> tuple[str | None, Any]:
        """Return its message, once the pipe is readable; `None` and the reason if it died."""
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


def _serve(pipe: Connection, work: bytes, folder: str) -> None:
    """Be a worker process: `work` is a pickled `Work`, `folder` the temporary folder with the socket of the server."""
    serve_parent(folder)
    try:
        import_pybullet_silently()
        worker = Worker(pickle.loads(work))
        pipe.send((READY, None))
        while True:
            pipe.send((RESULT, worker.work(pipe.recv())))
    except EOFError:
        return
    except Exception as error:
        with suppress(OSError):  # the parent process has ended
            pipe.send((ERROR, _portable(error)))


def _portable(error: Exception) -> Exception:
    """Return the error in a form that pickles, with the traceback as a note."""
    trace = "".join(traceback.format_exception(error))
    try:
        error = pickle.loads(pickle.dumps(error))
    except Exception:  # its constructor takes something else than its message
        error = RuntimeError(f"{type(error).__name__}: {error}")
    error.add_note(f"in a worker:\n{trace}")
    return error


class Worker:
    """The work of every worker, whether it is a process here or an actor of a Ray cluster."""

    def __init__(self, work: Work) -> None:
        if work.threads is not None:
            import torch

            torch.set_num_threads(work.threads)
        self._task, self._loaded = work.task, work.load(*work.arguments)

    def work(self, job: Any) -> Any:
        return self._task(self._loaded, job)


def serve_parent(folder: str) -> None:
    """Let this process ignore Ctrl-C and a closed terminal, but not SIGTERM, and end with the process that started it.

    Args:
        folder: the temporary folder of that process (`get_temp_dir`), which is removed then.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # a closed terminal reaches all of them likewise
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)
    threading.Thread(target=_wait_for_parent, args=(folder,), daemon=True).start()


def _wait_for_parent(folder: str) -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    shutil.rmtree(folder, ignore_errors=True)  # a parent that was killed could not remove it
    os._exit(1)
