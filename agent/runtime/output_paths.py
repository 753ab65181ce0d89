"""Check `--out` before any work, so that nothing is computed that cannot be written."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import Any

from agent.errors import BadInput, UsageError
from grounding.atomic_files import write_whole


def check_folder(folder: Path | None) -> None:
    """Check that files can be written into a folder, whether or not it exists; nothing is left behind.

    Args:
        folder: the value of `--out`; `None` if there is no output.

    Raises:
        UsageError: if it is a file.
        BadInput: if nothing can be written there.
    """
    if folder is None:
        return
    try:
        if folder.exists() and not folder.is_dir():
            raise UsageError(f"--out must be a folder, but {str(folder)!r} is a file")
        _try_folder(folder)
    except OSError as error:
        raise BadInput(f"{_cannot_be(folder, error)}; legal: a folder that can be written to") from error


def check_file(file: Path | None) -> None:
    """Check that a file can be written, whether or not it exists; nothing is left behind.

    Args:
        file: the value of `--out`; `None` if there is no output.

    Raises:
        UsageError: if it is a folder.
        BadInput: if it cannot be written.
    """
    if file is None:
        return
    try:
        if file.is_dir():
            raise UsageError(f"--out must be a file, but {str(file)!r} is a folder")
        if file.is_file():
            file.open("ab").close()
        elif not file.exists():  # what else is there, a pipe or a terminal, cannot be tried
            _try_folder(file.parent)
    except OSError as error:
        raise BadInput(f"{_cannot_be(file, error)}; legal: a file in a folder that can be written to") from error


@contextmanager
def folder_or_new(folder: Path | None, name: str) -> Iterator[Path]:
    """Yield the value of `--out` or, without one, a new folder `out/DATE-TIME-name`, which is removed if it stays
    empty.

    It is new even if the clock was set back, or another command of that name began in the same second.
    """
    if folder is not None:
        yield folder
        return
    name = f"{datetime.now():%Y%m%d-%H%M%S}-{name}"
    for number in count(1):
        new = Path("out") / (name if number == 1 else f"{name}-{number}")
        with suppress(FileExistsError):
            new.mkdir(parents=True)
            break
    try:
        yield new
    finally:
        with suppress(OSError):  # it is not empty
            new.rmdir()
            new.parent.rmdir()


def state_folder() -> Path | None:
    """Return the folder for what outlives a command, structagent in XDG_STATE_HOME or ~/.local/state; `None` without a
    home folder.
    """
    state = os.environ.get("XDG_STATE_HOME", "")
    if state:
        return Path(state) / "structagent"
    home = os.path.expanduser("~")
    return None if home == "~" else Path(home) / ".local" / "state" / "structagent"


def write_report(report: Mapping[str, Any], path: Path) -> list[Path]:
    """Write a report as a JSON file, create its folder if missing, and return its path."""
    write_whole(path, json.dumps(report, indent=1) + "\n")
    return [path]


def _try_folder(folder: Path) -> None:
    nearest = next(path for path in (folder, *folder.parents) if path.exists())
    tempfile.TemporaryFile(dir=nearest).close()


def _cannot_be(path: Path, error: OSError) -> str:
    return f"--out cannot be {str(path)!r}, where nothing can be written ({(error.strerror or str(error)).lower()})"
