"""Show progress on standard error: a bar with the time left, or plain lines now and then if it is not a terminal."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

from agent.runtime.terminal_text import console_on

if TYPE_CHECKING:
    from rich.progress import Progress

PLAIN_SECONDS = 10.0  # between two plain lines
SLOW_SECONDS = 2.0  # after which work that cannot say how far it is says at least that it goes on
Result = TypeVar("Result")


def progress_bar(quiet: bool = False) -> Progress:
    """Return a progress bar on standard error; it draws nothing if that is not a terminal or `quiet` is set."""
    from rich import progress as bars  # takes 20 ms to import, and most commands draw no bar

    return bars.Progress(
        bars.TextColumn("{task.description}"),
        bars.BarColumn(),
        bars.MofNCompleteColumn(),
        bars.TimeElapsedColumn(),
        bars.TimeRemainingColumn(),
        console=console_on(sys.stderr),
        disable=quiet or not sys.stderr.isatty(),
    )


@contextmanager
def progress(what: str, total: int, done: int = 0, failed: int = 0) -> Iterator[Callable[..., None]]:
    """Give a function to call after every completed item, with whether it succeeded (by default, it did).

    The function also takes a line about the item, which is printed at once with the item's number and the time left.

    Args:
        what: the plural term for the items, such as "rows".
        total: the number of items, including those done before.
        done: the number of items done before.
        failed: the number of those that failed.
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
    """Yield the same results, `total` in number, while their progress is shown."""
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
    """Report on standard error that work continues, first after 2 s and then every 10 s.

    Args:
        what: a description of the work, such as "reading the meshes in 'cups'".
        worth: returns whether to report, called each time; small inputs are never slow for long.
        first, then: seconds until the first report, and between later ones.
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
    """Format a duration: "40 s", "3 min", "2 h 5 min"."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"
