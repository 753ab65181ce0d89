"""Read clouds from .ply and .pcd files; their headers are compared with their lengths before any array is made."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from agent.errors import BadInput
from agent.recordings.cloud_colors import COLOR_FIELDS, colors_of
from agent.recordings.cloud_rows import Columns
from agent.recordings.depth_units import in_metres
from agent.recordings.message_decoding import without_nothing
from agent.recordings.pcd import read_pcd
from agent.recordings.ply import read_ply
from agent.runtime.progress import report_when_slow
from structdiffusion.limits import SLOW_BAG_BYTES

_READERS = {".pcd": read_pcd, ".ply": read_ply}
SUFFIXES = tuple(_READERS)
_AXES = ("x", "y", "z")


def read_columns(path: Path, needed: Sequence[str], wanted: frozenset[str] = frozenset()) -> tuple[int, int, Columns]:
    """Read the rows and columns of a cloud, and some fields of its points.

    Args:
        path: a .ply or .pcd file.
        needed: names of fields, in lower case.
        wanted: names of fields that may be missing.

    Raises:
        BadInput: for a file that is not there, damaged, empty, or without a needed field.
    """
    if not path.is_file():
        raise BadInput(f"there is no cloud {str(path)!r}")
    try:
        with report_when_slow(f"reading {str(path)!r}", lambda: path.stat().st_size > SLOW_BAG_BYTES):
            return _READERS[path.suffix.lower()](path, wanted | set(needed), needed)
    except BadInput as error:
        raise BadInput(f"the cloud {str(path)!r} cannot be read: {error}") from error
    except OSError as error:
        raise BadInput(f"the cloud {str(path)!r} cannot be read: {error.strerror or error}") from error


def read_cloud(path: Path, unit: float | None = None) -> tuple[np.ndarray, np.ndarray | None, tuple[str, ...]]:
    """Read points (H, W, 3) float32, metres, colours (H, W, 3) uint8 or `None`, and assumptions, a sentence each.

    An organised .pcd keeps its rows and columns; any other cloud is one row.

    Args:
        path: the file.
        unit: metres per unit of its coordinates; by default metres, unless what is seen contradicts that.

    Raises:
        BadInput: for a file that is not there, damaged, empty, or without coordinates, or whose unit is not certain.
    """
    height, width, columns = read_columns(path, _AXES, COLOR_FIELDS)
    points = np.empty((height * width, 3), np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        for number, axis in enumerate(_AXES):
            points[:, number] = columns.pop(axis)
        points[~np.isfinite(points).all(axis=1)] = np.nan
    points, notes = in_metres(points, unit, f"the coordinates in {str(path)!r}")
    colors = colors_of(columns, (height * width,))
    if columns and colors is None:
        notes = (*notes, f"its colours were left out: {', '.join(columns)} are not red, green and blue")
    points = without_nothing(points)
    if not np.isfinite(points).any():
        raise BadInput(f"the cloud {str(path)!r} has no point that measures anything")
    shape = (height, width, 3)
    return points.reshape(shape), None if colors is None else colors.reshape(shape), notes
