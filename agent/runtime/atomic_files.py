"""Replace files completely or not at all: after a full disk or a killed process the earlier content remains."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

_PREFIX, _SUFFIX = ".structagent-", ".part"


def write_whole(path: Path, content: bytes | str) -> None:
    """Write one file, text as UTF-8; a symbolic link with its name is replaced, not followed.

    Raises:
        OSError: if it cannot be written; the file is then unchanged.
    """
    write_all_whole(path.parent, {path.name: content})


def write_all_whole(folder: Path, files: Mapping[str, bytes | str]) -> None:
    """Write several files into one folder; none is replaced before all of them fit on the disk.

    Args:
        folder: the folder; created if missing.
        files: name -> content.

    Raises:
        OSError: if one cannot be written; all files are then unchanged.
    """
    folder.mkdir(parents=True, exist_ok=True)
    staged: dict[Path, Path] = {}
    try:
        for name, content in files.items():
            path = folder / name
            if path.is_dir() and not path.is_symlink():  # refused here, before any other file is replaced
                raise IsADirectoryError(21, "is a directory", str(path))
            staged[path] = _staged(path, content.encode() if isinstance(content, str) else content)
        for path, unfinished in staged.items():
            os.replace(unfinished, path)
        _force_names(folder)
    finally:
        for unfinished in staged.values():
            with contextlib.suppress(OSError):
                unfinished.unlink(missing_ok=True)


def _staged(path: Path, content: bytes) -> Path:
    """Write the content to a new file beside `path`, force it to the disk, and return its path."""
    try:
        file, unfinished = unfinished_file(path)
        try:
            with file:
                while content:  # a system takes part of it where the disk is nearly full
                    content = content[file.write(content) :]
                os.fsync(file.fileno())
        except BaseException:
            unfinished.unlink()
            raise
    except OSError as error:
        error.filename = str(path)  # the name that the user knows
        raise
    return unfinished


def unfinished_file(path: Path) -> tuple[BinaryIO, Path]:
    """Open a new, empty, unbuffered file beside `path`, to be renamed to it; return the file and its own path."""
    descriptor, name = tempfile.mkstemp(prefix=_PREFIX, suffix=_SUFFIX, dir=path.parent)
    os.fchmod(descriptor, 0o666 & ~_umask())  # a temporary file is readable by its owner alone
    return os.fdopen(descriptor, "wb", buffering=0), Path(name)


def _force_names(folder: Path) -> None:
    """Force a folder's entries to the disk, so that a power cut does not bring back the replaced file."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):  # not every file system can
            os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _umask() -> int:
    before = os.umask(0o022)
    os.umask(before)
    return before
