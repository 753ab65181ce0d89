"""End a command in order when the system asks it to end: with SIGTERM, or with SIGHUP because its terminal was closed.

Without this, a signal ends the process at once, and nobody ends its workers, marks its report, or removes its temporary
files. A second signal still does.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_REASONS = {signal.SIGTERM: "terminated", signal.SIGHUP: "the terminal was closed"}


class Terminated(SystemExit):
    """The command was asked to end. It ends the process as `sys.exit` does, so that no error handler catches it.

    Attributes:
        code: the exit code, 128 and the number of the signal.
        reason: a few words.
    """

    def __init__(self, number: int) -> None:
        super().__init__(128 + number)
        self.reason = _REASONS[signal.Signals(number)]


@contextmanager
def termination_raised() -> Iterator[None]:
    """Raise `Terminated` in the main thread on these signals, unless somebody else handles or ignores them."""
    taken = []
    if threading.current_thread() is threading.main_thread():
        taken = [number for number in _REASONS if signal.getsignal(number) is signal.SIG_DFL]
    for number in taken:
        signal.signal(number, _raise)
    try:
        yield
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_DFL)


def _raise(number: int, frame: FrameType | None) -> None:
    signal.signal(number, signal.SIG_DFL)
    raise Terminated(number)
