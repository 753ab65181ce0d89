"""Map the classes of ImageNet to the nouns of household objects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

_TABLE = Path(__file__).with_name("imagenet_nouns.tsv")
CLASSES = 1000


@dataclass(frozen=True)
class Vocabulary:
    """The nouns and their classes.

    Attributes:
        nouns: all nouns, sorted.
        of_class: (1000,) the index of each class's noun; -1 for the classes of nothing that stands on a table.
    """

    nouns: tuple[str, ...]
    of_class: np.ndarray

    def shares(self, logits: np.ndarray) -> Mapping[str, float]:
        """Return noun -> probability, summed over its classes and averaged over the pictures, from logits (N, 1000)."""
        shares = np.exp(logits - logits.max(axis=1, keepdims=True))
        shares = (shares / shares.sum(axis=1, keepdims=True)).mean(axis=0)
        known = self.of_class >= 0
        sums = np.bincount(self.of_class[known], shares[known], len(self.nouns))
        return dict(zip(self.nouns, sums.tolist(), strict=True))


@lru_cache(maxsize=1)
def vocabulary() -> Vocabulary:
    """Read the table of classes and nouns."""
    rows = [line.split("\t") for line in _TABLE.read_text(encoding="utf-8").splitlines()]
    nouns = tuple(sorted({noun for _, _, noun in rows}))
    of_class = np.full(CLASSES, -1)
    for number, _, noun in rows:
        of_class[int(number)] = nouns.index(noun)
    return Vocabulary(nouns, of_class)
