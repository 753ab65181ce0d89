"""What holds for all tests of a process."""

import gc
import shlex
import signal

import pytest

from tests.commands import forked_python

# Tests of 5 s and more, the longest first, in groups that go to one process after the other: no process is to be busy
# with such a test when the others have ended, and those of the language model would wait for each other.
PINNED = "tests/grounding/test_outcomes.py::test_labelled_texts_are_read_as_pinned"
DIALOGUES = "tests/grounding/dialogue/test_goal_dialogues.py"
LONG = (
    (f"{PINNED}[held_out",),
    (f"{PINNED}[free", "tests/grounding/test_slot_sentences.py::test_as_many_sentences"),
    (f"{PINNED}[strangers", "tests/test_code_style.py"),
    (f"{DIALOGUES}::test_dialogues[unseen j", "tests/grounding/test_figure_sentences.py"),
    (DIALOGUES,),
    ("tests/grounding/dialogue/test_unseen_corrections.py",),
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


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
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
