"""Next to: an object on any side of another, close to it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grounding.goals.parts import RelationPart
from structdiffusion.evaluation_protocol import MAX_NEXT_TO_GAP, max_gap_off
from structdiffusion.footprints import clear_gap
from structdiffusion.observation import Table
from structdiffusion.relations.candidates import Candidates
from structdiffusion.relations.directional import places_at_gaps
from structdiffusion.relations.figure import Figure
from structdiffusion.relations.relation import Relation, within
from structdiffusion.structures.checks import Check

_DRAWN_GAP = (0.015, 0.05)  # m, where places are drawn
_SURE_GAP = 0.02  # m inside the limit, from where on more is no better
_LEAST_GAP = 0.004  # m: outlines that touch are stacked by the smallest error


class NextTo(Relation):
    """An object at most 8 cm of clear gap from its reference, and not stacked."""

    name = "next to"

    def check(self, figure: Figure, references: Sequence[Figure], part: RelationPart) -> list[Check]:
        """Check the clear gap, and that neither stands on the other."""
        (reference,) = references
        gap = clear_gap(figure.outline, reference.outline)
        low, high = _limits(part.distance)
        stacked = sum(
            i in other.members
            for one, other in ((figure, reference), (reference, figure))
            for body in one.bodies
            for i in body.rests_on
        )
        return [
            Check("clear gap (m)", low <= gap <= high, gap, f"{low:.3f} to {high:.3f}"),
            Check("objects on top of others", stacked == 0, stacked, "0"),
        ]

    def sample(
        self,
        figure: Figure,
        references: Sequence[Figure],
        part: RelationPart,
        count: int,
        rng: np.random.Generator,
    ) -> np.ndarray:
        """Draw centroids (count, 2) all around the reference."""
        (reference,) = references
        angles = rng.uniform(-math.pi, math.pi, count)
        gaps = (
            rng.uniform(*_DRAWN_GAP, count) if part.distance is None else np.full(count, max(part.distance, _LEAST_GAP))
        )
        return places_at_gaps(figure, reference, angles, gaps)

    def margins(
        self, figures: Candidates, references: Sequence[Figure], part: RelationPart, table: Table
    ) -> np.ndarray:
        """Return the margins (C,) of the clear gap."""
        (reference,) = references
        low, high = _limits(part.distance)
        gaps = figures.gaps(reference.outline)
        if part.distance is None:
            return np.where(gaps < _LEAST_GAP, -1.0, within(gaps, -math.inf, high, _SURE_GAP))
        return np.where(gaps < _LEAST_GAP, -1.0, within(gaps, low, high, (high - low) / 2))


def _limits(distance: float | None) -> tuple[float, float]:
    if distance is None:
        return 0.0, MAX_NEXT_TO_GAP
    off = max_gap_off(distance)
    return max(0.0, distance - off), distance + off
