"""Start `structagent` in a process of its own without waiting for its imports.

A process that has imported the libraries forks each command, so a command costs its own work and not 1 to 3 s of
imports. The command is a real process with the arguments, folder, environment, standard streams and signals that the
test gives; only the start of the interpreter is not its own. Tests whose subject is that start (what is imported,
locale, broken packages) take `[sys.executable, "-m", "agent"]`.

The processes of pytest-xdist are forked off the same process, as `tests/conftest.py` asks.
"""

from __future__ import annotations

import atexit
import functools
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


_SERVER = "COMMAND_SERVER"  # the variable with the path of the server's socket, where several test processes have one


def structagent(*arguments: str) -> list[str]:
    """Return the command line that runs `structagent` with arguments, for `subprocess`, a shell or a terminal."""
    return [*_launcher(os.environ.get(_SERVER) or _server(os.getpid())), *arguments]


def python_program(code: str) -> list[str]:
    """Return the command line that runs code as `python -u -c CODE` does, with the libraries imported already."""
    return [*structagent("--python"), "-u", "-c", code]


def forked_python() -> list[str]:
    """Start a server for this test process and those that it starts; return the start of a command line.

    What follows it is `-u -c CODE`: a Python process that has imported the libraries runs that code.
    """
    os.environ[_SERVER] = _server(os.getpid(), "tests")
    return [*_launcher(os.environ[_SERVER]), "--python"]


def _launcher(path: str) -> list[str]:
    return [sys.executable, "-IS", str(ROOT / "tests" / "command_launcher.py"), path]


@functools.cache
def _server(process: int, *arguments: str) -> str:
    """Start the server of this test process; return the path of its socket."""
    folder = tempfile.mkdtemp(prefix="commands-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    path = os.path.join(folder, "socket")
    path_of_modules = os.pathsep.join((str(ROOT), str(ROOT / "agent" / "public")))
    server = subprocess.Popen(
        [sys.executable, ROOT / "tests" / "command_server.py", path, *arguments],
        env={**os.environ, "PYTHONPATH": path_of_modules, "OMP_NUM_THREADS": "1"},
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    assert server.stdout is not None and server.stdout.readline() == "ready\n", "the command server did not start"
    return path
