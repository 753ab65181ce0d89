"""Left of, right of, in front of and behind: an object on one side of another, clear of it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grounding.goals.parts import RelationPart
from structdiffusion.evaluation_protocol import (
    MAX_RELATION_GAP,
    MAX_RELATION_OFF_DEGREES,
    MIN_RELATION_GAP,
    max_gap_off,
)
from structdiffusion.footprints import clear_gap, separation_along
from structdiffusion.observation import Table
from structdiffusion.relations.candidates import Candidates
from structdiffusion.relations.figure import Figure
from structdiffusion.relations.relation import Relation, beside, within
from structdiffusion.structures.checks import Check

_DRAWN_DEGREES, _DRAWN_GAP = 30.0, (0.015, 0.12)  # where places are drawn: well inside the limits
_SURE_DEGREES, _SURE_GAP = 15.0, 0.015  # from a limit, from where on more is no better


class Directional(Relation):
    """An object within 45 degrees of a direction from its reference.

    Args:
        name: of the relation.
        direction: (x, y) in the world frame, a unit vector.
    """

    def __init__(self, name: str, direction: tuple[float, float]) -> None:
        self.name, self.direction = name, np.array(direction)

    def check(self, figure: Figure, references: Sequence[Figure], part: RelationPart) -> list[Check]:
        """Check the direction between the centroids, and the clear gap."""
        (reference,) = references
        along, across = beside(figure.centroid - reference.centroid, self.direction)
        off = abs(math.degrees(math.atan2(across, along)))
        limit = MAX_RELATION_OFF_DEGREES
        gap = clear_gap(figure.outline, reference.outline)
        low, high = gap_limits(part.distance)
        return [
            Check("direction (deg off)", off <= limit, off, f"<= {limit:g}"),
            Check("clear gap (m)", low <= gap <= high, gap, f"{low:.3f} to {high:.3f}"),
        ]

    def sample(
        self,
        figure: Figure,
        references: Sequence[Figure],
        part: RelationPart,
        count: int,
        rng: np.random.Generator,
    ) -> np.ndarray:
        """Draw centroids (count, 2) at clear gaps inside the limits."""
        (reference,) = references
        middle = math.atan2(self.direction[1], self.direction[0])
        angles = middle + np.radians(rng.triangular(-_DRAWN_DEGREES, 0.0, _DRAWN_DEGREES, count))
        if part.distance is None:
            gaps = rng.uniform(*_DRAWN_GAP, count)
        else:
            gaps = np.full(count, max(part.distance, MIN_RELATION_GAP + 0.002))
        return places_at_gaps(figure, reference, angles, gaps)

    def margins(
        self, figures: Candidates, references: Sequence[Figure], part: RelationPart, table: Table
    ) -> np.ndarray:
        """Return the smaller of the margins of the direction and the clear gap, (C,)."""
        (reference,) = references
        along, across = beside(figures.centroids - reference.centroid, self.direction)
        off = np.abs(np.degrees(np.arctan2(across, along)))
        sides = within(off, -math.inf, MAX_RELATION_OFF_DEGREES, _SURE_DEGREES)
        return np.minimum(sides, gap_margins(figures.gaps(reference.outline), part.distance))


def gap_limits(distance: float | None) -> tuple[float, float]:
    """Return the smallest and the largest legal clear gap, metres, of a relation on one side of its reference."""
    if distance is None:
        return MIN_RELATION_GAP, MAX_RELATION_GAP
    off = max_gap_off(distance)
    return max(MIN_RELATION_GAP, distance - off), distance + off


def gap_margins(gaps: np.ndarray, distance: float | None) -> np.ndarray:
    """Return how far clear gaps (C,) lie inside their limits; a requested distance is best where it is exact."""
    low, high = gap_limits(distance)
    return within(gaps, low, high, _SURE_GAP if distance is None else (high - low) / 2)


def places_at_gaps(figure: Figure, reference: Figure, angles: np.ndarray, gaps: np.ndarray) -> np.ndarray:
    """Return centroids (C, 2) of a figure in directions (C,), radians, from its reference at clear gaps (C,),
    metres.
    """
    own, other = figure.outline - figure.centroid, reference.outline - reference.centroid
    own, other = (_counter_clockwise(outline) for outline in (own, other))
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    apart = [separation_along(other, own, direction, gap) for direction, gap in zip(directions, gaps, strict=True)]
    return reference.centroid + np.array(apart)[:, None] * directions


def _counter_clockwise(outline: np.ndarray) -> np.ndarray:
    following = np.roll(outline, -1, axis=0)
    area = (outline[:, 0] * following[:, 1] - following[:, 0] * outline[:, 1]).sum()
    return outline if area >= 0 else outline[::-1]
