"""What holds for all tests of a process."""

import gc
import os
import shlex
import signal
from collections import defaultdict

import pytest

from tests.commands import forked_python

# Tests of 5 s and more, the longest first, in groups that go to one process after the other: no process is to be busy
# with such a test when the others have ended, and those of the language model would wait for each other.
PINNED = "tests/grounding/test_outcomes.py::test_labelled_texts_are_read_as_pinned"
RATES = "tests/grounding/dialogue/test_rates.py::test_rates"
LONG = (
    (f"{PINNED}[held_out",),
    (f"{PINNED}[free", "tests/grounding/test_slot_sentences.py::test_as_many_sentences"),
    (f"{PINNED}[strangers", "tests/test_code_style.py"),
    (f"{RATES}[corrections", "tests/grounding/test_figure_sentences.py"),
    (RATES,),
    ("tests/agent/batch/test_run.py",),
    ("tests/agent/evaluation/test_",),
    ("tests/grounding/parsers/test_llm_local.py",),
    ("tests/structdiffusion/objects/test_everyday.py", "tests/structdiffusion/training/test_distributed.py"),
    ("tests/agent/public/test_package.py",),
    ("tests/agent/chat/test_transcripts.py",),
    ("tests/agent/chat/test_steering.py", "tests/agent/chat/test_timeline.py"),
    ("tests/agent/arm/test_closed_loop.py",),
    ("tests/agent/evaluation/loop/", "tests/agent/evaluation/interjections/"),
    ("tests/agent/batch/test_workers.py",),
    ("tests/agent/evaluation/success/", "tests/agent/mcp/test_hostile.py"),
    ("tests/agent/chat/test_repl.py",),
    ("tests/agent/chat/test_conversation.py",),
    ("tests/agent/arm/test_tracking.py",),
    ("tests/agent/pipeline/test_disturbance.py", "tests/agent/pipeline/test_laying_out.py"),
)


SECONDS = "structagent/seconds"  # in pytest's cache: how long each test took when it ran last
QUICK = 0.1  # s: of the tests, more than three quarters take less


class SecondsOfTests:
    """Keeps in pytest's cache how long each test takes, which `make test FAST=1` goes by."""

    def __init__(self, config: pytest.Config) -> None:
        self._config, self._seconds = config, defaultdict[str, float](float)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._seconds[report.nodeid] += report.duration

    def pytest_sessionfinish(self) -> None:
        self._config.cache.set(SECONDS, self._config.cache.get(SECONDS, {}) | self._seconds)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what took longer than `QUICK` when it ran last, where only what is quick is asked for."""
    if os.environ.get("FAST"):
        seconds = config.cache.get(SECONDS, {})
        slow = [item for item in items if seconds.get(item.nodeid, 0.0) > QUICK]
        items[:] = [item for item in items if seconds.get(item.nodeid, 0.0) <= QUICK]
        config.hook.pytest_deselected(items=slow)
    _long_ones_first(config, items)


def _long_ones_first(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Let each process, which is given the same number of tests at first, begin with long ones."""
    count = getattr(config, "workerinput", {}).get("workercount", 1)
    groups: list[list[pytest.Item]] = [[] for _ in LONG]
    others = []
    for item in items:
        group = next((number for number, paths in enumerate(LONG) if item.nodeid.startswith(paths)), None)
        (others if group is None else groups[group]).append(item)
    first = [[item for group in groups[number::count] for item in group] for number in range(count)]
    ordered: list[pytest.Item] = []
    for number, long in enumerate(first, start=1):
        ordered += long
        room = max(0, number * len(items) // count - len(ordered))
        ordered += others[:room]
        del others[:room]
    items[:] = ordered + others


def pytest_configure(config: pytest.Config) -> None:
    """Take Ctrl-C's signal, which a shell's background job ignores: tests interrupt themselves and commands with it."""
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(SecondsOfTests(config))
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
