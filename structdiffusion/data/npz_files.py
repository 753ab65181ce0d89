"""Read and write the .npz files of training data: written atomically, and checked when read."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any
from zipfile import BadZipFile
from zlib import error as ZlibError

import numpy as np

from grounding.atomic_files import write_whole


class DataFolderError(ValueError):
    """Raised if a folder of training data cannot be used or holds other data than requested; the message has the
    reason.
    """


def save_arrays(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Write a compressed .npz file atomically: it is complete or absent."""
    content = io.BytesIO()
    named: dict[str, Any] = {**arrays}
    np.savez_compressed(content, **named)
    write_whole(path, content.getvalue())


def read_arrays(path: Path, *names: str) -> dict[str, np.ndarray]:
    """Read arrays from a .npz file.

    Args:
        path: the file.
        names: the arrays to read; by default all.

    Raises:
        FileNotFoundError: if there is no such file.
        DataFolderError: if it is damaged, is not a .npz file, or lacks an array.
    """
    again = f"remove it, and `structagent generate --out {path.parent}` makes it again"
    try:
        loaded = np.load(path, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            raise DataFolderError(f"{path} is one array, and must be a file of named arrays; {again}")
        with loaded:
            lacking = [name for name in names if name not in loaded]
            if lacking:
                raise DataFolderError(f"{path} lacks the array {lacking[0]!r}; {again}")
            return {name: loaded[name] for name in names or loaded.files}
    except DataFolderError:
        raise
    except (BadZipFile, ZlibError, EOFError, ValueError) as error:
        raise DataFolderError(f"{path} is incomplete, or not a file of arrays; {again}") from error


SHEET_NAME = "datasheet.json"  # datasheet of a data folder
