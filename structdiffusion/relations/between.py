"""Between: an object about halfway from one reference to another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from grounding.goals.parts import RelationPart
from structdiffusion.evaluation_protocol import BETWEEN_SHARES, MAX_OFF_BETWEEN
from structdiffusion.observation import Table
from structdiffusion.relations.candidates import Candidates
from structdiffusion.relations.figure import Figure
from structdiffusion.relations.relation import Relation, within
from structdiffusion.structures.checks import Check

_SURE_SHARE, _SURE_OFF = 0.1, 0.015  # inside the limits (share of the way; m), from where on more is no better


class Between(Relation):
    """An object near the straight line between two references."""

    name = "between"
    references = 2

    def check(self, figure: Figure, references: Sequence[Figure], part: RelationPart) -> list[Check]:
        """Check how far along the way the object is, and how far off it."""
        share, off = _along_the_way(figure.centroid, references)
        low, high = BETWEEN_SHARES
        return [
            Check("share of the way between", bool(low <= share <= high), float(share), f"{low:g} to {high:g}"),
            Check("off the way between (m)", bool(off <= MAX_OFF_BETWEEN), float(off), f"<= {MAX_OFF_BETWEEN:g}"),
        ]

    def sample(
        self,
        figure: Figure,
        references: Sequence[Figure],
        part: RelationPart,
        count: int,
        rng: np.random.Generator,
    ) -> np.ndarray:
        """Draw centroids (count, 2) about the middle of the way."""
        start, way = references[0].centroid, references[1].centroid - references[0].centroid
        shares = rng.triangular(BETWEEN_SHARES[0], 0.5, BETWEEN_SHARES[1], count)
        across = np.array([-way[1], way[0]]) / max(1e-9, float(np.linalg.norm(way)))
        off = rng.triangular(-MAX_OFF_BETWEEN, 0.0, MAX_OFF_BETWEEN, count)
        return start + shares[:, None] * way + off[:, None] * across

    def margins(
        self, figures: Candidates, references: Sequence[Figure], part: RelationPart, table: Table
    ) -> np.ndarray:
        """Return the smaller of the margins (C,) along the way and across it."""
        share, off = _along_the_way(figures.centroids, references)
        return np.minimum(within(share, *BETWEEN_SHARES, _SURE_SHARE), within(off, -np.inf, MAX_OFF_BETWEEN, _SURE_OFF))


def _along_the_way(points: np.ndarray, references: Sequence[Figure]) -> tuple[np.ndarray, np.ndarray]:
    """Return the shares of the way from one reference to the other at points (..., 2), and how far, metres, off it they
    are.
    """
    start = references[0].centroid
    way = references[1].centroid - start
    length = max(1e-9, float(np.linalg.norm(way)))
    offset = points - start
    return offset @ way / length**2, np.abs(offset @ np.array([-way[1], way[0]])) / length
