"""Ctrl-C that stops nothing ends the chat all the same."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
# A program that swallows every interruption, and says so; `stopped` is called after those that are named.
PROGRAM = """
import os, signal, sys
from agent.chat.interrupts import exit_on_repeated_interrupts
signal.signal(signal.SIGINT, getattr(signal, {handler!r}))
with exit_on_repeated_interrupts(sys.stdout) as stopped:
    for number in range(1, 6):
        try:
            os.kill(os.getpid(), signal.SIGINT)
            print("ignored", number, flush=True)
        except KeyboardInterrupt:
            print("swallowed", number, flush=True)
        if number in {sent}:
            stopped()
print("left", signal.getsignal(signal.SIGINT) is getattr(signal, {handler!r}))
"""


@pytest.mark.parametrize(
    ("handler", "sent", "code", "shown"),
    [
        ("default_int_handler", (), 130, ["swallowed 1", "swallowed 2"]),
        ("default_int_handler", (2,), 130, [f"swallowed {number}" for number in range(1, 5)]),
        ("default_int_handler", (2, 4), 0, [*(f"swallowed {number}" for number in range(1, 6)), "left True"]),
        ("SIG_IGN", (), 0, [*(f"ignored {number}" for number in range(1, 6)), "left True"]),
    ],
)
def test_the_third_that_stops_nothing_ends_the_process(handler, sent, code, shown):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(handler=handler, sent=sent)], capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert (done.returncode, done.stdout.splitlines()) == (code, shown), done.stderr
    assert done.stderr == ("structagent: interrupted\n" if code else "")
