"""How far a command is, on standard error: a bar with the time left, or off a terminal a plain line now and then."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from agent.runtime.terminal_text import console_on

PLAIN_SECONDS = 10.0  # between two plain lines
SLOW_SECONDS = 2.0  # after which work that cannot say how far it is says at least that it goes on
Result = TypeVar("Result")


def progress_bar(quiet: bool = False) -> Progress:
    """A bar on standard error; it draws nothing where that is no terminal, or when it is to be quiet."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console_on(sys.stderr),
        disable=quiet or not sys.stderr.isatty(),
    )


@contextmanager
def progress(what: str, total: int, done: int = 0, failed: int = 0) -> Iterator[Callable[..., None]]:
    """Take, for every piece of work that ends, whether it succeeded; it did where nothing is said.

    It takes a line about the piece, too, which is told at once with the piece's number and the time left.

    Args:
        what: the pieces are called, as "rows".
        total: how many there are, those done before any work included.
        done: how many were done before.
        failed: how many of those have failed.
    """
    began = first = reported = time.monotonic()
    at_once, bar = done, progress_bar(quiet=total == done)  # no bar where there is nothing to do
    task = bar.add_task(_description(what, failed), total=total, completed=done)

    def advance(success: bool = True, line: str | None = None) -> None:
        nonlocal done, failed, first, reported
        done, failed = done + 1, failed + (not success)
        bar.update(task, completed=done, description=_description(what, failed))
        now = time.monotonic()
        if line is not None:
            left = (now - began) / (done - at_once) * (total - done)
            line = f"{done} of {total}: {line}" + (f", about {span(left)} left" if done < total else "")
            if bar.disable:
                print(line, file=sys.stderr, flush=True)
            else:
                bar.console.print(line, markup=False, highlight=False, soft_wrap=True)
        if done == at_once + 1:
            first = now
        if line is not None and done < total:
            return
        if bar.disable and (now - reported >= PLAIN_SECONDS or done == total):
            reported = now
            said = f"{done} of {total} {_description(what, failed)}"
            if done == total:
                said += f" in {span(now - began)}"
            elif now > first:  # the first says little: workers load their networks before it
                said += f", about {span((now - first) / (done - at_once - 1) * (total - done))} left"
            print(said, file=sys.stderr, flush=True)

    with bar:
        yield advance


def followed(what: str, results: Iterable[Result], total: int) -> Iterator[Result]:
    """The same results, of which there are `total`, while it is told how many have come."""
    with progress(what, total) as advance:
        for result in results:
            advance()
            yield result


@contextmanager
def report_when_slow(
    what: str,
    worth: Callable[[], bool] = lambda: True,
    first: float = SLOW_SECONDS,
    then: float = PLAIN_SECONDS,
) -> Iterator[None]:
    """Say on standard error that something goes on, when it takes more than 2 s, and every 10 s after that.

    Args:
        what: is done, as "reading the meshes in 'cups'".
        worth: whether to say so, asked each time; what is small is never slow for long.
        first, then: seconds until it is said, and until it is said again.
    """
    ended, began = threading.Event(), time.monotonic()

    def report() -> None:
        wait = first
        while not ended.wait(wait):
            if worth():
                print(f"{what}: {span(time.monotonic() - began)} so far", file=sys.stderr, flush=True)
            wait = then

    reporter = threading.Thread(target=report, daemon=True)
    reporter.start()
    try:
        yield
    finally:
        ended.set()
        reporter.join()


def _description(what: str, failed: int) -> str:
    return f"{what}, {failed} failed" if failed else what


def span(seconds: float) -> str:
    """A time for people: "40 s", "3 min", "2 h 5 min"."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"
