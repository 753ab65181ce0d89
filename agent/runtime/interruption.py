"""Handle Ctrl-C from the first import of a command to its end: it ends in "interrupted" alone, whenever it comes.

An interruption that comes while a library is imported is raised once that is imported: a half imported library fails in
ways of its own. Nobody waits longer than `_PATIENCE` for that. One that comes where nothing can be raised, as in the
deletion of an object, is raised right after it.
"""

from __future__ import annotations

import atexit
import os
import signal
import sys
from types import FrameType
from typing import Any, NoReturn

INTERRUPTED = 130
_IMPORTS = "<frozen importlib._bootstrap>"
_ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
_OURS = tuple(os.path.join(_ROOT, package, "") for package in ("agent", "structdiffusion", "grounding"))
_PATIENCE = 1.0  # s
_SOON = 0.001  # s
_SHOW_CURSOR = b"\x1b[?25h\r"

_pressed = 0
_exit_code: int | None = None


def handle_interruptions() -> None:
    """Let the first Ctrl-C raise `KeyboardInterrupt`, and the second one end the process; call it in the main thread.

    A process that ignores Ctrl-C, such as a background process of a shell, continues to ignore it.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _handle)
        sys.unraisablehook = _raise_later
        atexit.register(_end_with_exit_code)  # the first that is registered is the last that is called


def ignore_further_interruptions() -> None:
    """Let Ctrl-C do nothing any more, in a process whose result is known; only after `handle_interruptions`."""
    if signal.getsignal(signal.SIGINT) is _handle:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def keep_exit_code(code: object) -> None:
    """Let the process end with this exit code (that of a `SystemExit`), even if it was interrupted.

    Python otherwise ends itself by the signal where an interruption has left the evaluation of a text, as dataclasses
    and type annotations need it, although the interruption was caught.
    """
    global _exit_code
    if code is None or isinstance(code, int):
        _exit_code = code or 0


def _end_with_exit_code() -> None:
    if _pressed and _exit_code is not None:
        os._exit(_exit_code)


def _handle(number: int, frame: FrameType | None) -> None:
    global _pressed
    _pressed += 1
    if _pressed > 1:
        end_at_once()
    interrupt(frame, _PATIENCE)


def interrupt(frame: FrameType | None, patience: float | None = None) -> None:
    """Raise `KeyboardInterrupt`: now, or where a frame is at the import of a library, after that.

    Args:
        frame: where the process is.
        patience: how long the import may take, s, before the process is ended; `None` for as long as it takes.
    """
    importer = _importer(frame)
    if importer is None:
        raise KeyboardInterrupt

    def after_import(*_: Any) -> NoReturn:
        importer.f_trace = None
        sys.settrace(None)
        signal.setitimer(signal.ITIMER_REAL, 0)
        raise KeyboardInterrupt

    importer.f_trace = after_import
    sys.settrace(lambda *_: None)  # no frame is traced without it
    if patience is not None:
        signal.signal(signal.SIGALRM, lambda *_: end_at_once())
        signal.setitimer(signal.ITIMER_REAL, patience)


def _importer(frame: FrameType | None) -> FrameType | None:
    """Return the frame of ours that imports a library; `None` where nothing is imported, or only a module of ours."""
    library = importing = False
    while frame is not None:
        place = frame.f_code.co_filename
        if place.startswith(_OURS):
            return frame if library and importing else None
        importing = importing or place == _IMPORTS
        library = library or not place.startswith("<frozen importlib")
        frame = frame.f_back
    return None


def _raise_later(unraisable: Any) -> None:
    if issubclass(unraisable.exc_type, KeyboardInterrupt):
        signal.signal(signal.SIGALRM, lambda number, frame: interrupt(frame))
        signal.setitimer(signal.ITIMER_REAL, _SOON)
    else:
        sys.__unraisablehook__(unraisable)


def end_at_once() -> NoReturn:
    """Say "interrupted" on standard error, make its terminal usable, and end the process without waiting for anything.

    Worker processes end with the process that started them, and files are written whole or not at all.
    """
    try:
        if os.isatty(2):
            import termios

            os.write(2, _SHOW_CURSOR)
            attributes = termios.tcgetattr(2)
            attributes[3] |= termios.ECHO | termios.ECHOCTL | termios.ICANON | termios.ISIG
            termios.tcsetattr(2, termios.TCSANOW, attributes)
        os.write(2, b"structagent: interrupted\n")
    except (OSError, ImportError):  # there is no terminal any more, or none to set
        pass
    finally:
        os._exit(INTERRUPTED)
