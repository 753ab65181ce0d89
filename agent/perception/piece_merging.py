"""Merge pieces into objects: the two that are likeliest to be of one object first, until no two are likely to be."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from agent.perception.pieces import Piece, Pieces, Proposals, Surface

_ONE = 0.5  # probability from which on two pieces are one object
_SURE = 0.98  # from which on pairs are merged at once, without another look at what they have become
# Returns how likely (N,) pairs of pieces are of one object by their features.
Judge = Callable[[Sequence[Mapping[str, float]]], np.ndarray]
Pair = tuple[int, int]


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
        best = max(likely, key=likely.__getitem__)
        if likely[best] < _ONE:
            break
        sure = [pair for pair, share in likely.items() if share >= _SURE] or [best]
        became: dict[int, int] = {}
        for one, other in sure:
            while one in became:
                one = became[one]
            while other in became:
                other = became[other]
            if one != other:
                graph.merge(one, other)
                became[other] = one
        changed = graph.refresh()
        likely = {pair: likely[pair] for pair in graph.pairs if pair in likely} | _judged(graph, changed, judge)
    return graph.of_voxel


def _judged(graph: PieceGraph, pairs: list[Pair], judge: Judge) -> dict[Pair, float]:
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
        self.pieces: dict[int, Piece] = {}
        self.pairs: dict[Pair, np.ndarray] = {}
        self._contacts = pieces.contacts()
        self._stale = set(np.unique(self.of_voxel[self.of_voxel >= 0]).tolist())
        self.refresh()

    def features(self, pair: Pair) -> dict[str, float]:
        """Return the features of a pair."""
        return self._all.features(self.pieces[pair[0]], self.pieces[pair[1]], self.pairs[pair])

    def merge(self, one: int, other: int) -> None:
        """Make two pieces the piece `one`; it is described by the next `refresh`."""
        self.of_voxel[self.of_voxel == other] = one
        self._stale = (self._stale | {one}) - {other}
        for gone in (one, other):
            self.pieces.pop(gone, None)
        for pair in [pair for pair in self._contacts if other in pair]:
            contacts = self._contacts.pop(pair)
            third = pair[0] if pair[1] == other else pair[1]
            if third != one:
                self._meet(one, third, contacts if pair[0] == other else contacts[:, ::-1])

    def refresh(self) -> list[Pair]:
        """Describe the pieces that were merged since; return their pairs, whose features are others now."""
        stale, self._stale = self._stale, set()
        for number in sorted(stale):
            self.pieces[number] = self._all.describe(np.flatnonzero(self.of_voxel == number))
        known = self.pieces.keys()
        self.pairs = {pair: met for pair, met in self.pairs.items() if set(pair) <= known and not set(pair) & stale}
        every = {(min(one, other), max(one, other)) for one in stale for other in known if other != one}
        return [pair for pair in sorted(every) if self._add(pair)]

    def _meet(self, one: int, other: int, contacts: np.ndarray) -> None:
        """Add contacts (C, 2), the voxels of `one` first."""
        key = (min(one, other), max(one, other))
        contacts = contacts if one < other else contacts[:, ::-1]
        had = self._contacts.get(key)
        self._contacts[key] = contacts if had is None else np.vstack((had, contacts))

    def _add(self, pair: Pair) -> bool:
        """Make two pieces a pair if they could be of one object; return whether they are."""
        contacts = self._contacts.get(pair, np.empty((0, 2), dtype=np.int64))
        if not self._all.may_be_one(self.pieces[pair[0]], self.pieces[pair[1]], len(contacts)):
            return False
        self.pairs[pair] = contacts
        return True
