"""Compare found objects with the true ones: exact counts, overlap, boundaries, split and swallowed objects.

Overlap and boundary are those of the literature on unseen objects: found and true objects are matched one to one so
that their F scores add up to the most; precision is the share of all found pixels (boundary pixels) that the matched
true object has too, recall the share of all true ones that the matched found object has.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from scipy import ndimage
from scipy.optimize import linear_sum_assignment

_MATCHED = 0.5  # intersection over union above which an object is found
_PIECE = 0.1  # of an object in each of two found ones: it is split
_MOST = 0.5  # of what belongs to an object
_BOUNDARY = 3  # pixels by which boundaries may be apart


@dataclass(frozen=True)
class Scores:
    """How well one cloud is segmented.

    Attributes:
        objects, found: true and found objects.
        matched: true objects with a found one that shares more than half of the union.
        exact: as many are found as there are, and all are matched.
        overlap, boundary: precision, recall and F.
        split: true objects in two or more found ones that hold mostly it.
        swallowed: true objects that lie mostly in a found one that holds mostly another, or two of them.
        missed: true objects that lie mostly in no found one.
        phantoms: found objects that lie mostly in no true one.
    """

    objects: int
    found: int
    matched: int
    exact: bool
    overlap: tuple[float, float, float]
    boundary: tuple[float, float, float]
    split: int
    swallowed: int
    missed: int
    phantoms: int

    def to_dict(self) -> dict[str, object]:
        """Return JSON values."""
        return asdict(self)


def scores_of(found: np.ndarray, true: np.ndarray) -> Scores:
    """Compare labels (H, W), objects from 1 on and 0 or less elsewhere."""
    found, true = _numbered(found), _numbered(true)
    shared = _confusion(found, true)
    found_size, true_size = shared.sum(axis=1), shared.sum(axis=0)
    inner, of_found, of_true = shared[1:, 1:], found_size[1:], true_size[1:]
    union = of_found[:, None] + of_true[None] - inner
    matched = int(((inner / np.maximum(union, 1)) > _MATCHED).any(axis=0).sum())
    pairs = linear_sum_assignment(-2.0 * inner / np.maximum(of_found[:, None] + of_true[None], 1))
    # Most of what a found object has of any true object is of its own.
    main = inner.argmax(axis=1) if inner.size else np.zeros(len(of_found), dtype=int)
    real = inner.max(axis=1, initial=0) > _MOST * of_found
    split = swallowed = missed = 0
    for index, size in enumerate(of_true):
        pieces = (inner[:, index] > _PIECE * size) & (inner[:, index] > _MOST * of_found)
        split += int(pieces.sum() > 1)
        holders = np.flatnonzero(inner[:, index] > _MOST * size)
        swallowed += int(len(holders) == 1 and main[holders[0]] != index)
        missed += int(inner[:, index].sum() < _MOST * size)
    exact = len(of_found) == len(of_true) == matched
    return Scores(
        len(of_true), len(of_found), matched, exact, _three(inner[pairs].sum(), of_found.sum(), of_true.sum()),
        _boundary(found, true, pairs), split, swallowed, missed, int((~real).sum()),
    )  # fmt: skip


def _numbered(labels: np.ndarray) -> np.ndarray:
    """Return labels without gaps in the objects' numbers, and 0 elsewhere."""
    known = np.unique(labels[labels > 0])
    return np.where(labels > 0, np.searchsorted(known, labels) + 1, 0)


def _confusion(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Return the number of pixels (found + 1, true + 1) of each pair of labels."""
    rows, columns = int(found.max()) + 1, int(true.max()) + 1
    return np.bincount((found * columns + true).ravel(), minlength=rows * columns).reshape(rows, columns)


def _three(shared: float, found: float, true: float) -> tuple[float, float, float]:
    """Return precision, recall and F; all are 1 where nothing was to be found and nothing was."""
    if found == true == 0:
        return 1.0, 1.0, 1.0
    precision, recall = shared / max(found, 1), shared / max(true, 1)
    return float(precision), float(recall), float(2 * precision * recall / max(precision + recall, 1e-12))


def _boundary(found: np.ndarray, true: np.ndarray, pairs: tuple[np.ndarray, np.ndarray]) -> tuple[float, float, float]:
    """Return precision, recall and F of the boundaries of matched pairs."""
    precise = recalled = 0
    for one, other in zip(*pairs, strict=True):
        edges = [_edge(labels == number + 1) for labels, number in ((found, one), (true, other))]
        near = [ndimage.distance_transform_edt(~edge) <= _BOUNDARY if edge.any() else edge for edge in edges]
        precise += int((edges[0] & near[1]).sum())
        recalled += int((edges[1] & near[0]).sum())
    every = [sum(int(_edge(labels == k).sum()) for k in range(1, labels.max() + 1)) for labels in (found, true)]
    if every == [0, 0]:
        return 1.0, 1.0, 1.0
    precision, recall = precise / max(every[0], 1), recalled / max(every[1], 1)
    return precision, recall, 2 * precision * recall / max(precision + recall, 1e-12)


def _edge(mask: np.ndarray) -> np.ndarray:
    return mask & ~ndimage.binary_erosion(mask)
