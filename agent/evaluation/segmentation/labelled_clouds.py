"""Read organised clouds with a true label for every point, in the form of the modified Object Segmentation Database.

A .pcd file has a field `label`: 0 for points that count nowhere, 1 to 9 for the table, 20 to 29 for parts of the first
object, 30 to 39 for parts of the second one, and so on.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agent.errors import BadInput
from agent.recordings.point_cloud_files import read_cloud, read_columns

_FIRST, _PER_OBJECT = 20, 10  # labels of the first object begin there, and so many are of each
_LEARN = ((0, "boxes"), (17, "stacked"), (25, "occluded"), (33, "cylinders"))
_TEST = ((0, "boxes"), (16, "stacked"), (24, "occluded"), (31, "cylinders"), (43, "mixed"), (55, "complex"))
_CLASSES = {"learn": _LEARN, "test": _TEST}  # of that database, from which number on


@dataclass(frozen=True)
class LabelledCloud:
    """A measurement with the truth beside it.

    Attributes:
        name: which it is.
        kind: its class, such as "stacked".
        points: (H, W, 3) float32, the camera's optical frame, metres; NaN where nothing was measured.
        color: (H, W, 3) uint8 RGB, or `None`.
        labels: (H, W) int: the object's number from 1 on; 0 elsewhere.
        sensor: the camera; empty where it is unknown.
    """

    name: str
    kind: str
    points: np.ndarray
    color: np.ndarray | None
    labels: np.ndarray
    sensor: str = ""


def labelled_files(folder: Path) -> list[Path]:
    """Return the clouds of a folder and its subfolders, in the order of their names and numbers.

    Raises:
        BadInput: when there are none.
    """
    if not folder.is_dir():
        raise BadInput(f"there is no folder {str(folder)!r}")
    files = sorted(folder.rglob("*.pcd"), key=lambda path: (path.parent, *_stem_and_number(path)))
    if not files:
        raise BadInput(f"the folder {str(folder)!r} holds no labelled cloud; legal: .pcd files with a field 'label'")
    return files


def read_labelled(path: Path) -> LabelledCloud:
    """Read a labelled cloud.

    Raises:
        BadInput: for a file that is damaged, or has no labels.
    """
    points, color, _ = read_cloud(path, 1.0)
    label = read_columns(path, ("label",))[2]["label"].astype(np.int64).reshape(points.shape[:2])
    own = label // _PER_OBJECT
    known = np.unique(own[label >= _FIRST])
    labels = np.where(label >= _FIRST, np.searchsorted(known, own) + 1, 0)
    labels[~np.isfinite(points).all(axis=-1)] = 0
    return LabelledCloud(path.stem, class_of(path), points, color, labels)


def class_of(path: Path) -> str:
    """Return the class of a cloud: that of the database for its file names, otherwise the name without its number."""
    stem, number = _stem_and_number(path)
    return next((name for least, name in reversed(_CLASSES.get(stem, ())) if number >= least), stem or "all")


def _stem_and_number(path: Path) -> tuple[str, int]:
    found = re.fullmatch(r"(.*?)[-_ ]*(\d*)", path.stem)
    assert found is not None  # every text is of this form
    return found[1], int(found[2] or 0)
