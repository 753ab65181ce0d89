"""Handle Ctrl-C in a chat: it stops the current work, and the third one that stops nothing ends the process."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import IO

from agent.runtime.interruption import end_at_once, interrupt

_INSISTENT = 3


@contextmanager
def exit_on_repeated_interrupts(screen: IO[str]) -> Iterator[Callable[[], None]]:
    """End the process with exit code 130 at the third Ctrl-C that stops nothing.

    The first two raise `KeyboardInterrupt` as usual. A library may catch one or lose it in a callback, and loading a
    library must not be cut short, so the third one ends the process without waiting. The session is written line by
    line, so nothing of it is lost. A process that ignores Ctrl-C, such as a background process of a shell, continues
    to ignore it.

    Args:
        screen: the stream that the chat is shown on.
    """
    pressed = 0

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        pressed += 1
        if pressed >= _INSISTENT:
            with suppress(OSError, ValueError):
                screen.flush()
            end_at_once()
        interrupt(frame)

    def stopped() -> None:
        nonlocal pressed
        pressed = 0

    # Signals can be handled in the main thread alone.
    in_main, before = threading.current_thread() is threading.main_thread(), signal.getsignal(signal.SIGINT)
    if not in_main or not callable(before):
        yield stopped
        return
    signal.signal(signal.SIGINT, handle)
    try:
        yield stopped
    finally:
        signal.signal(signal.SIGINT, before)
