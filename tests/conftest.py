"""What holds for all tests of a process."""

import gc
import shlex
import signal

import pytest

from tests.commands import forked_python

# Files with tests of 5 s and more: they come first, so that no process is busy with one when the others have ended.
LONG = (
    "tests/grounding/parsers/test_llm_local.py",
    "tests/grounding/llm_goals/test_local.py",
    "tests/agent/batch/",
    "tests/agent/chat/test_transcripts.py",
    "tests/agent/chat/test_repl.py",
    "tests/agent/evaluation/success/",
    "tests/agent/evaluation/test_",
    "tests/agent/public/test_package.py",
    "tests/structdiffusion/objects/test_everyday.py",
    "tests/structdiffusion/training/test_distributed.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let long tests come first; the order is otherwise as it was, and the same in every process."""
    items.sort(key=lambda item: not item.nodeid.startswith(LONG))


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
