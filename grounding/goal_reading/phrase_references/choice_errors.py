"""Define what can be in the way when the objects of a copied phrase are chosen."""

from __future__ import annotations

from collections.abc import Sequence


class NothingFits(Exception):
    """No object, or too few, is what a phrase describes."""


class Doubt(Exception):
    """More objects fit a phrase than it speaks of; `found` has them."""

    def __init__(self, found: Sequence[int]) -> None:
        self.found = list(found)
        super().__init__(f"several fit: {self.found}")
