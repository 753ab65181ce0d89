"""Start `structagent` in a process of its own without waiting for its imports.

A process that has imported the libraries forks each command, so a command costs its own work and not 1 to 3 s of
imports. The command is a real process with the arguments, folder, environment, standard streams and signals that the
test gives; only the start of the interpreter is not its own. Tests whose subject is that start (what is imported,
locale, broken packages) take `[sys.executable, "-m", "agent"]`.
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


def structagent(*arguments: str) -> list[str]:
    """Return the command line that runs `structagent` with arguments, for `subprocess`, a shell or a terminal."""
    return [sys.executable, "-IS", str(ROOT / "tests" / "command_launcher.py"), _server(os.getpid()), *arguments]


@functools.cache
def _server(process: int) -> str:
    """Start the server of this test process; return the path of its socket."""
    folder = tempfile.mkdtemp(prefix="commands-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    path = os.path.join(folder, "socket")
    path_of_modules = os.pathsep.join((str(ROOT), str(ROOT / "agent" / "public")))
    server = subprocess.Popen(
        [sys.executable, ROOT / "tests" / "command_server.py", path],
        env={**os.environ, "PYTHONPATH": path_of_modules, "OMP_NUM_THREADS": "1"},
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    assert server.stdout is not None and server.stdout.readline() == "ready\n", "the command server did not start"
    return path
