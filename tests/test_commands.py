"""Commands that are forked off the command server are those of `python -m agent`, in all that a caller sees."""

import os
import pty
import signal
import subprocess
import sys
import time

import pytest

from tests.commands import ROOT, structagent

COLD = [sys.executable, "-m", "agent"]


def done(command: list[str], folder, **more) -> tuple[int, str, str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CONFIG_HOME": str(folder)}
    ended = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, **more)
    return ended.returncode, ended.stdout, ended.stderr


@pytest.mark.parametrize(
    ("arguments", "code"),
    [(["parse", "stack the cans", "fly to the moon"], 3), (["config", "show"], 0), (["replay", "no\tsuch ✓ file"], 6)],
)
def test_a_forked_command_says_and_gives_the_same(arguments, code, tmp_path):
    forked = done(structagent(*arguments), tmp_path)
    assert forked == done([*COLD, *arguments], tmp_path) and forked[0] == code


def test_standard_input_and_the_environment_are_the_commands_own(tmp_path):
    assert done(structagent("parse", "--json"), tmp_path, input="make a line\n")[1].count('"line"') >= 1
    (tmp_path / "structagent").mkdir()
    (tmp_path / "structagent" / "config.toml").write_text("seed = 7\n")
    assert "7" in done(structagent("config", "show"), tmp_path)[1]


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGKILL, -9)]
)
def test_signals_reach_it(number, code, tmp_path):
    process = subprocess.Popen(
        structagent("parse", "--json"), cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL, text=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    process.stdin.write("make a line\n")
    process.stdin.flush()
    process.stdout.readline()
    time.sleep(0.3)  # a signal while it still writes the line would have it written again at the end
    process.send_signal(number)
    assert process.wait() == code
    assert process.stdout.read() == ""  # ends only when the command itself is gone


def test_a_terminal_is_a_terminal_for_it(tmp_path):
    leader, follower = pty.openpty()
    process = subprocess.Popen(
        structagent("doctor", "--help"), stdin=follower, stdout=follower, stderr=follower, cwd=tmp_path,
        env={**os.environ, "COLUMNS": "60"},
    )  # fmt: skip
    os.close(follower)
    shown = b""
    try:
        while chunk := os.read(leader, 65536):
            shown += chunk
    except OSError:  # the other end is closed
        pass
    os.close(leader)
    assert process.wait() == 0 and b"Example: structagent doctor" in shown and b"\r\n" in shown
