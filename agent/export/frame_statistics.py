"""Sum up the values of all frames, one run after the other: what policies are normalised with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
_PICTURES = 20  # of a run, evenly spread, that count
_LEVELS = 256


class VectorStatistics:
    """The statistics of vectors (T, n) of several runs."""

    def __init__(self) -> None:
        self._rows: list[np.ndarray] = []

    def add(self, rows: np.ndarray) -> None:
        """Add the vectors (T, n) of a run."""
        self._rows.append(np.asarray(rows, np.float64))

    def to_dict(self) -> dict[str, Any]:
        """Return minimum, maximum, mean, standard deviation, quantiles and count, JSON-ready."""
        rows = np.concatenate(self._rows)
        values = {"min": rows.min(axis=0), "max": rows.max(axis=0), "mean": rows.mean(axis=0), "std": rows.std(axis=0)}
        quantiles = np.quantile(rows, list(QUANTILES.values()), axis=0)
        values |= dict(zip(QUANTILES, quantiles, strict=True))
        return {key: value.tolist() for key, value in values.items()} | {"count": [len(rows)]}


class PictureStatistics:
    """The statistics of the three colours of pictures, each 0 to 1: of a histogram of some pictures of each run."""

    def __init__(self) -> None:
        self._pixels = np.zeros((3, _LEVELS), np.int64)
        self._count = 0

    def add(self, pictures: Sequence[np.ndarray]) -> None:
        """Add the pictures (H, W, 3) uint8 of a run."""
        chosen = np.unique(np.linspace(0, len(pictures) - 1, _PICTURES).astype(int))
        self._count += len(chosen)
        for index in chosen:
            for color in range(3):
                self._pixels[color] += np.bincount(pictures[index][..., color].ravel(), minlength=_LEVELS)

    def to_dict(self) -> dict[str, Any]:
        """Return the same as `VectorStatistics`, each value (3, 1, 1); the count is that of the pictures."""
        levels, total = np.arange(_LEVELS) / (_LEVELS - 1), self._pixels[0].sum()
        shares = self._pixels / total
        mean = shares @ levels
        below = self._pixels.cumsum(axis=1)
        values = {
            "min": levels[(self._pixels > 0).argmax(axis=1)],
            "max": levels[_LEVELS - 1 - (self._pixels[:, ::-1] > 0).argmax(axis=1)],
            "mean": mean,
            "std": np.sqrt(np.maximum(shares @ levels**2 - mean**2, 0.0)),
            **{name: levels[(below >= share * total).argmax(axis=1)] for name, share in QUANTILES.items()},
        }
        return {key: value.reshape(3, 1, 1).tolist() for key, value in values.items()} | {"count": [self._count]}
