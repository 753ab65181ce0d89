"""Ctrl-C, whenever it comes, ends a command in "interrupted" alone, with exit code 130 and no process left."""

import os
import random
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
SAID = "structagent: interrupted\n"
EVALUATION = ("evaluate", "success", "--model", "geometric", "--structure", "line", "--scenes", "3", "--workers", "2")


def cold(*arguments: str, **options) -> subprocess.Popen:
    """Start Python with the default treatment of Ctrl-C, as the leader of a process group, as a terminal does."""
    return subprocess.Popen(
        [sys.executable, *arguments], text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join((str(ROOT), str(ROOT / "agent" / "public")))},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler), **options,
    )  # fmt: skip


def of_group(group: int) -> dict[int, str]:
    """Return the living processes of a group, each with its command line."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, _, of = (folder / "stat").read_text().rpartition(")")[2].split()[:3]
            if int(of) == group and state not in "ZX":
                found[int(folder.name)] = (folder / "cmdline").read_text().replace("\0", " ")
        except OSError:  # it has ended meanwhile
            continue
    return found


def check_ended(process: subprocess.Popen, said: str) -> None:
    said = re.sub(r"^\d+ of \d+ [^\n]*\n", "", said, flags=re.MULTILINE)  # the progress
    assert (process.wait(), said) == (130, SAID)
    while left := of_group(process.pid):  # a server that is still importing ends after that
        servers = "forkserver", "tracker", "spawn"  # and a process that is just ending has no command line any more
        assert all(not line or any(server in line for server in servers) for line in left.values())
        time.sleep(0.05)


@pytest.mark.parametrize("presses", [1, 2])
def test_while_anything_is_imported(presses):
    """The moments are those at which so many modules are imported, of those that Python lists, after our first one."""
    for moment in random.Random(presses).sample(range(2, 500), 3):
        process = cold("-X", "importtime", "-m", "agent", "parse", "stack the cans")
        count, said = 0, []
        for line in process.stderr:
            if not line.startswith("import time:"):
                said.append(line)
                continue
            count += bool(count) or line.rstrip().endswith(" agent.runtime.interruption")
            if count == moment:
                count += 1
                for _ in range(presses):
                    os.killpg(process.pid, signal.SIGINT)
        check_ended(process, "".join(said))


@pytest.mark.skipif(not Path("/proc/self/cmdline").exists(), reason="it looks for processes in /proc")
@pytest.mark.parametrize("moment", ["server", "row"])
def test_while_workers_start_and_while_they_work(moment, tmp_path):
    process = cold("-m", "agent", *EVALUATION, "--out", str(tmp_path / "out"))
    rows = tmp_path / "out" / "rows.jsonl"

    def come() -> bool:
        if moment == "server":
            return any("forkserver" in line for line in of_group(process.pid).values())
        return rows.exists() and rows.read_text().count("\n")

    while not come():
        assert process.poll() is None
        time.sleep(0.005)  # or looking takes as much processor time as the command
    os.killpg(process.pid, signal.SIGINT)
    check_ended(process, process.stderr.read())


PROGRAM = """
import os, signal, sys, time
from agent.runtime.interruption import handle_interruptions, ignore_further_interruptions
handle_interruptions()
def press():
    os.kill(os.getpid(), signal.SIGINT)
{body}
"""


def program(body: str, **options) -> tuple[int, str, str]:
    process = cold("-c", PROGRAM.format(body=body), **options)
    shown, said = process.communicate()
    return process.returncode, shown, said


def test_a_library_is_imported_as_a_whole(tmp_path):
    (tmp_path / "whole.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGINT)\nprint('whole')\n")
    ours = tmp_path / "agent_like.py"
    ours.write_text("import whole\nprint('not reached')\n")
    body = f"""
import importlib.util
import agent.runtime.interruption as interruption
interruption._OURS = ({str(ours)!r},)
sys.path.insert(0, {str(tmp_path)!r})
try:
    import agent_like
except KeyboardInterrupt:
    print("raised", sys.gettrace(), "whole" in sys.modules)
"""
    assert program(body) == (0, "whole\nraised None True\n", "")


def test_the_second_one_does_not_wait_for_the_end_of_the_first():
    body = "try:\n    press()\nfinally:\n    print('ends', flush=True)\n    press()\n    print('not reached')"
    assert program(body) == (130, "ends\n", SAID)


def test_one_that_nothing_can_raise_is_raised_afterwards():
    body = """
class Thing:
    def __del__(self):
        press()
try:
    Thing()
    time.sleep(60)
    print("not reached")
except KeyboardInterrupt:
    print("raised")
"""
    assert program(body) == (0, "raised\n", "")


@pytest.mark.parametrize(("then", "code"), [("raise", 130), ("sys.exit(3)", 3), ("pass", 0)])
def test_one_that_leaves_a_text_in_evaluation_ends_with_the_exit_code_all_the_same(then, code, tmp_path):
    """Python would end itself by the signal: inspect and dataclasses evaluate texts while commands are assembled."""
    (tmp_path / "evaluates.py").write_text(f"""
import os, signal, sys
import agent.__main__ as command
def evaluate():
    try:
        eval("os.kill(os.getpid(), signal.SIGINT)")
    except KeyboardInterrupt:
        {then}
command._command_line = evaluate
command.main()
""")
    process = cold("-m", "evaluates", cwd=tmp_path)
    assert (process.communicate()[1], process.returncode) == (SAID if code == 130 else "", code)


def test_it_is_told_where_pybullet_is_imported_without_its_greeting(tmp_path):
    (tmp_path / "pybullet.py").write_text(
        "import os, signal\nos.write(2, b'greeting')\nos.kill(os.getpid(), signal.SIGINT)\n"
    )
    body = f"""
sys.path.insert(0, {str(tmp_path)!r})
from structdiffusion.simulation.pybullet_import import import_pybullet_silently
try:
    import_pybullet_silently()
except KeyboardInterrupt:
    print("interrupted", file=sys.stderr)
"""
    assert program(body) == (0, "", "interrupted\n")


def test_nothing_interrupts_what_has_ended():
    assert program("ignore_further_interruptions()\npress()\nprint('done')") == (0, "done\n", "")


def test_a_background_process_goes_on_ignoring_it():
    body = "signal.signal(signal.SIGINT, signal.SIG_IGN)\nhandle_interruptions()\npress()\nprint('on')"
    assert program(body) == (0, "on\n", "")
