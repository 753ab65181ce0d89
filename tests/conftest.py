"""What holds for all tests of a process."""

import gc
import shlex
import signal

import pytest

from tests.commands import forked_python


def pytest_configure() -> None:
    """Take Ctrl-C's signal, which a shell's background job ignores: tests interrupt themselves and commands with it."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes(specs) -> None:
    """Fork the test processes off one that has imported the libraries, instead of importing them in each."""
    python = shlex.join(forked_python())
    for spec in specs:
        spec.python = python


def pytest_collection_finish() -> None:
    """Spare the garbage collector the tests and the libraries, which stay until the end."""
    gc.collect()
    gc.freeze()


def pytest_sessionfinish() -> None:
    """Give everything back: libraries that count their objects at the end would report the frozen ones as lost."""
    gc.unfreeze()
