"""Merge pieces into objects: the two that are likeliest to be of one object first, until no two are likely to be."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from agent.perception.pieces import Piece, Pieces, Proposals, Surface

_ONE = 0.5  # probability from which on two pieces are one object
# Returns how likely (N,) pairs of pieces are of one object by their features.
Judge = Callable[[Sequence[Mapping[str, float]]], np.ndarray]


def merged(surface: Surface, proposals: Proposals, judge: Judge) -> np.ndarray:
    """Return the object (V,) of each voxel, -1 where geometry has none.

    Args:
        surface: the voxels.
        proposals: of objects; with masks.
        judge: says which pairs of pieces are of one object.
    """
    graph = PieceGraph(Pieces(surface, proposals))
    likely = _judged(graph, list(graph.pairs), judge)
    while likely:
        pair = max(likely, key=likely.__getitem__)
        if likely[pair] < _ONE:
            break
        changed = graph.merge(*pair)
        likely = {key: value for key, value in likely.items() if not set(key) & set(pair)}
        likely |= _judged(graph, changed, judge)
    return graph.of_voxel


def _judged(graph: PieceGraph, pairs: list[tuple[int, int]], judge: Judge) -> dict[tuple[int, int], float]:
    if not pairs:
        return {}
    return dict(zip(pairs, judge([graph.features(pair) for pair in pairs]).tolist(), strict=True))


class PieceGraph:
    """Pieces, and which of them could be of one object.

    Args:
        pieces: to begin with.

    Attributes:
        of_voxel: (V,) the piece of each voxel so far, -1 for none.
        pieces: by their number.
        pairs: numbers of two pieces that could be of one object, the smaller first -> the pairs (C, 2) of voxels at
            which they meet.
    """

    def __init__(self, pieces: Pieces) -> None:
        self._all, self.of_voxel = pieces, pieces.of_voxel.copy()
        numbers = np.unique(self.of_voxel[self.of_voxel >= 0]).tolist()
        self.pieces: dict[int, Piece] = {k: pieces.describe(np.flatnonzero(self.of_voxel == k)) for k in numbers}
        self._contacts = pieces.contacts()
        self.pairs: dict[tuple[int, int], np.ndarray] = {}
        for place, one in enumerate(numbers):
            for other in numbers[place + 1 :]:
                self._add(one, other)

    def features(self, pair: tuple[int, int]) -> dict[str, float]:
        """Return the features of a pair."""
        return self._all.features(self.pieces[pair[0]], self.pieces[pair[1]], self.pairs[pair])

    def merge(self, one: int, other: int) -> list[tuple[int, int]]:
        """Make two pieces the piece `one`; return its pairs, whose features are others now."""
        self.of_voxel[self.pieces.pop(other).own] = one
        self.pieces[one] = self._all.describe(np.flatnonzero(self.of_voxel == one))
        self.pairs = {pair: meet for pair, meet in self.pairs.items() if not {one, other} & set(pair)}
        for pair in [pair for pair in self._contacts if other in pair]:
            meet = self._contacts.pop(pair)
            third = pair[0] if pair[1] == other else pair[1]
            if third != one:
                self._meet(one, third, meet if pair[0] == other else meet[:, ::-1])
        return [pair for third in self.pieces if third != one for pair in self._add(one, third)]

    def _meet(self, one: int, other: int, contacts: np.ndarray) -> None:
        """Add contacts (C, 2), the voxels of `one` first."""
        key = (min(one, other), max(one, other))
        contacts = contacts if one < other else contacts[:, ::-1]
        had = self._contacts.get(key)
        self._contacts[key] = contacts if had is None else np.vstack((had, contacts))

    def _add(self, one: int, other: int) -> list[tuple[int, int]]:
        """Make two pieces a pair if they could be of one object; return the pairs that there are now."""
        key = (min(one, other), max(one, other))
        contacts = self._contacts.get(key, np.empty((0, 2), dtype=np.int64))
        if not self._all.may_be_one(self.pieces[one], self.pieces[other], len(contacts)):
            return []
        self.pairs[key] = contacts
        return [key]
