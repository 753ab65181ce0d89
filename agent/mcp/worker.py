"""Do the work of all clients on one table in one thread, one job after the other, and stop a job that is under way."""

from __future__ import annotations

import asyncio
import functools
from collections.abc import Awaitable, Callable
from concurrent.futures import Future, ThreadPoolExecutor
from threading import Event as Flag
from typing import TypeVar

import anyio

from agent.errors import INTERRUPTED, AgentError, UsageError
from agent.runtime.memory import give_back

Result = TypeVar("Result")
Report = Callable[[int, str], Awaitable[None]]
MOST_WAITING = 16  # calls that wait for their turn; one more is refused


class StoppedError(AgentError):
    """A job was stopped before it was done."""

    exit_code = INTERRUPTED


class Job:
    """A piece of work on the table.

    Args:
        what: what it does, as in "plan-1 is being built".
        alone: whether other calls are refused, not queued, until it is done.

    Attributes:
        what, alone: as given.
        on_step: called with a sentence at every step, in the thread of the work.
        stopped: whether it noticed that it has to stop.
    """

    def __init__(self, what: str, alone: bool = False) -> None:
        self.what, self.alone = what, alone
        self.on_step: Callable[[str], None] = lambda step: None
        self.stopped = False
        self._stop, self._done = Flag(), asyncio.Event()

    def stop(self) -> None:
        """Ask the job to stop, from any thread."""
        self._stop.set()

    def check_stop(self, *_: object) -> None:
        """Raise `KeyboardInterrupt` once after `stop`, as Ctrl-C does in a chat: the arm halts, sets down what it holds
        and folds.
        """
        if self._stop.is_set() and not self.stopped:
            self.stopped = True
            raise KeyboardInterrupt

    def finish(self) -> None:
        """Tell those who wait for its end; to be called in the thread of the event loop."""
        self._done.set()

    async def wait(self) -> None:
        """Wait until it is done."""
        await self._done.wait()


class TableWorker:
    """The thread that works on the table."""

    def __init__(self) -> None:
        self._working: Job | None = None
        self._alone: Job | None = None
        self._waiting = 0
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="table")

    @property
    def job(self) -> Job | None:
        """What it is doing now, or what other calls are refused for until its caller has been told of its end."""
        return self._alone or self._working

    def close(self) -> None:
        """Wait for the job that is under way, and end the thread."""
        self._thread.shutdown(wait=True, cancel_futures=True)

    def at_once(self, work: Callable[[], Result]) -> Result:
        """Do some work in the thread and wait for it; for the time before and after clients are served."""
        return self._thread.submit(work).result()

    async def do(self, job: Job, work: Callable[[Job], Result], report: Report | None = None) -> Result:
        """Do a job in the thread. If the caller is cancelled, the job stops, and this ends when the arm is at rest.

        Args:
            job: the job.
            work: what is done.
            report: called with the number of each step and a sentence about it.

        Raises:
            UsageError: if the table is busy.
            StoppedError: if it was stopped, and does not return a result that says so.
        """
        if self._alone is not None:
            raise UsageError(f"the table is busy: {self._alone.what}; wait until that is done, or call stop")
        if self._waiting >= MOST_WAITING:
            raise UsageError(f"the table is busy: {MOST_WAITING} calls are waiting for their turn; try again later")
        loop, steps = asyncio.get_running_loop(), asyncio.Queue[str | None]()

        def put(step: str | None) -> None:
            loop.call_soon_threadsafe(steps.put_nowait, step)

        if report is not None:
            job.on_step = put
        self._waiting += 1
        if job.alone:
            self._alone = job
        future = self._thread.submit(functools.partial(self._run, job, work))
        future.add_done_callback(lambda _: put(None))
        try:
            await _report_steps(job, future, steps, report)
        finally:
            job.finish()
            self._waiting -= 1
            if self._alone is job:
                self._alone = None
        return future.result()

    async def stop(self) -> Job | None:
        """Stop the job that is under way, and return it when it has ended; `None` if there was none."""
        job = self.job
        if job is not None:
            job.stop()
            await job.wait()
        return job

    def _run(self, job: Job, work: Callable[[Job], Result]) -> Result:
        self._working = job
        try:
            return work(job)
        except KeyboardInterrupt:
            raise StoppedError("the call was stopped before it was done") from None
        finally:
            self._working = None
            give_back()


async def _report_steps(
    job: Job, future: Future[Result], steps: asyncio.Queue[str | None], report: Report | None
) -> None:
    """Report the steps of a job until it ends; stop it if nobody waits for it any more."""
    number = 0
    try:
        while (step := await steps.get()) is not None:
            number += 1
            if report is not None:
                await report(number, step)
    except BaseException:  # cancelled, or the client is gone
        job.stop()
        if not future.cancel():
            with anyio.CancelScope(shield=True):
                while await steps.get() is not None:
                    pass
        raise
