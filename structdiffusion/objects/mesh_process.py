"""Prepare one mesh in a separate process, which the operating system ends after a time limit.

Meshes are read, simplified and decomposed by libraries that no signal handler and no thread can interrupt. The process
sets an alarm for itself, so that it ends even if its parent has died.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from structdiffusion.limits import MESH_SECONDS

if TYPE_CHECKING:
    from structdiffusion.objects.model import ObjectModel


def prepare_apart(path: Path, name: str, category: str | None = None) -> list[ObjectModel]:
    """Prepare the objects of a mesh file in a separate process, with the result of `mesh_preparation.prepare`.

    Raises:
        ObjectError: as `prepare`, and if it takes more than `MESH_SECONDS` or its process ends unexpectedly.
    """
    from structdiffusion.objects.model import ObjectError

    # The same modules as in this process, and none from the current folder.
    modules = os.pathsep.join(entry for entry in sys.path if entry)
    done = subprocess.run(
        [sys.executable, "-P", "-m", __name__, str(path), name, category or "", str(MESH_SECONDS)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        env={**os.environ, "PYTHONPATH": modules},
    )
    if done.returncode == -signal.SIGALRM:
        raise ObjectError(
            f"preparing the mesh {str(path)!r} takes more than {MESH_SECONDS:g} s, and was stopped: simplify it"
        )
    if done.returncode != 0:
        raise ObjectError(f"the mesh {str(path)!r} cannot be prepared: {_end_of_process(done)}")
    result = pickle.loads(done.stdout)
    if isinstance(result, ObjectError):
        raise result
    sys.stderr.write(done.stderr.decode(errors="replace"))  # its warnings
    return result


def _end_of_process(done: subprocess.CompletedProcess[bytes]) -> str:
    if done.returncode < 0:
        return f"its process was ended by {signal.Signals(-done.returncode).name}"
    last = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
    return f"its process ended with exit code {done.returncode}" + "".join(f" ({line[:200]})" for line in last)


def _main(path: str, name: str, category: str, seconds: str) -> None:
    """Write the objects of a mesh file, or the `ObjectError` that it raises, to standard output, pickled."""
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_REAL, float(seconds))
    results = os.dup(1)
    os.dup2(2, 1)  # redirects the output of libraries to standard error
    from structdiffusion.objects.mesh_preparation import prepare
    from structdiffusion.objects.model import ObjectError

    try:
        result: list[ObjectModel] | ObjectError = prepare(Path(path), name, category or None)
    except ObjectError as error:
        result = ObjectError(str(error))
    with os.fdopen(results, "wb") as stream:
        pickle.dump(result, stream)


if __name__ == "__main__":
    _main(*sys.argv[1:])
