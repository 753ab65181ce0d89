"""Handle Ctrl-C in a chat: it stops the current work, and the third one that stops nothing ends the process."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TextIO

from agent.errors import INTERRUPTED

_INSISTENT = 3
_SHOW_CURSOR = "\x1b[?25h"


@contextmanager
def exit_on_repeated_interrupts(screen: TextIO) -> Iterator[Callable[[], None]]:
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
            _end_at_once(screen)
        signal.default_int_handler(number, frame)

    def stopped() -> None:
        nonlocal pressed
        pressed = 0

    # Signals can be handled in the main thread alone.
    in_main, before = threading.current_thread() is threading.main_thread(), signal.getsignal(signal.SIGINT)
    if not in_main or before is not signal.default_int_handler:
        yield stopped
        return
    signal.signal(signal.SIGINT, handle)
    try:
        yield stopped
    finally:
        signal.signal(signal.SIGINT, before)


def _end_at_once(screen: TextIO) -> None:
    with suppress(Exception):
        if screen.isatty():
            import termios

            os.write(screen.fileno(), f"{_SHOW_CURSOR}\n".encode())
            attributes = termios.tcgetattr(screen)
            attributes[3] |= termios.ECHO | termios.ECHOCTL | termios.ICANON | termios.ISIG
            termios.tcsetattr(screen, termios.TCSANOW, attributes)
        print("structagent: interrupted", file=sys.stderr, flush=True)
    os._exit(INTERRUPTED)
