"""How far a batch is, on standard error: a bar with the time left, or off a terminal a plain line now and then."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from agent.training import progress_bar

PLAIN_SECONDS = 10.0  # between two plain lines


@contextmanager
def progress(rows: int, failed: int) -> Iterator[Callable[[bool], None]]:
    """Takes, for every row that ends, whether it succeeded.

    Args:
        rows: how many there are to do, those that have failed already included.
        failed: how many have failed already, before any work.
    """
    began = first = told = time.monotonic()
    at_once, done, bar = failed, failed, progress_bar()
    task = bar.add_task(_description(failed), total=rows, completed=done)

    def tell(success: bool) -> None:
        nonlocal done, failed, first, told
        done, failed = done + 1, failed + (not success)
        bar.update(task, completed=done, description=_description(failed))
        now = time.monotonic()
        if done == at_once + 1:
            first = now
        if bar.disable and (now - told >= PLAIN_SECONDS or done == rows):
            told = now
            said = f"{done} of {rows} {_description(failed)}"
            if done == rows:
                said += f" in {span(now - began)}"
            elif now > first:  # the first row says little: workers load their networks before it
                said += f", about {span((now - first) / (done - at_once - 1) * (rows - done))} left"
            print(said, file=sys.stderr, flush=True)

    with bar:
        yield tell


def _description(failed: int) -> str:
    return f"rows, {failed} failed" if failed else "rows"


def span(seconds: float) -> str:
    """A time for people: "40 s", "3 min", "2 h 5 min"."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"
