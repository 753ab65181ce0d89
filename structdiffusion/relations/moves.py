"""Moved and swapped: the place of an object relative to initial places."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grounding.goals.parts import RelationPart
from structdiffusion.evaluation_protocol import MAX_MOVED_OFF, MAX_SWAPPED_OFF
from structdiffusion.observation import Table
from structdiffusion.relations.candidates import Candidates
from structdiffusion.relations.figure import Figure
from structdiffusion.relations.relation import Relation, beside, within
from structdiffusion.structures.checks import Check

DIRECTIONS = {"left": (0.0, 1.0), "right": (0.0, -1.0), "away": (1.0, 0.0), "closer": (-1.0, 0.0)}
# Where places are drawn besides the exact one, as a share of the limit: the exact place may be a little too close to a
# neighbour.
_DRAWN = 0.5


class Moved(Relation):
    """An object that has moved by a distance in a direction."""

    name = "moved"
    references = 0
    apart = True
    exact = True

    def check(self, figure: Figure, references: Sequence[Figure], part: RelationPart) -> list[Check]:
        """Check how far the object is off its way, along it and across."""
        off = figure.centroid - self._target(_before(figure), part)
        along, across = (abs(float(each)) for each in beside(off, _way(part)))
        limit = f"<= {MAX_MOVED_OFF:g}"
        return [
            Check(f"moved {part.direction}: off along (m)", along <= MAX_MOVED_OFF, along, limit),
            Check(f"moved {part.direction}: off across (m)", across <= MAX_MOVED_OFF, across, limit),
        ]

    def sample(
        self,
        figure: Figure,
        references: Sequence[Figure],
        part: RelationPart,
        count: int,
        rng: np.random.Generator,
    ) -> np.ndarray:
        """Draw centroids (count, 2) about the end of the way, the first exactly there."""
        return _about(self._target(_before(figure), part), MAX_MOVED_OFF, count, rng)

    def margins(
        self, figures: Candidates, references: Sequence[Figure], part: RelationPart, table: Table
    ) -> np.ndarray:
        """Return how near (C,) the centroids are to the end of the way."""
        off = figures.centroids - self._target(figures.before, part)
        return within(np.abs(off).max(axis=1), -math.inf, MAX_MOVED_OFF, MAX_MOVED_OFF)

    @staticmethod
    def _target(before: np.ndarray, part: RelationPart) -> np.ndarray:
        assert part.distance is not None
        return before + part.distance * _way(part)


def _way(part: RelationPart) -> np.ndarray:
    assert part.direction is not None
    return np.array(DIRECTIONS[part.direction])


class Swapped(Relation):
    """An object at the place of its reference, which goes to the object's own place."""

    name = "swapped"
    apart = True
    mutual = True
    exact = True

    def check(self, figure: Figure, references: Sequence[Figure], part: RelationPart) -> list[Check]:
        """Check the object's distance from the other one's initial place."""
        off = float(np.linalg.norm(figure.centroid - _before(references[0])))
        return [Check("off the other's place (m)", off <= MAX_SWAPPED_OFF, off, f"<= {MAX_SWAPPED_OFF:g}")]

    def sample(
        self,
        figure: Figure,
        references: Sequence[Figure],
        part: RelationPart,
        count: int,
        rng: np.random.Generator,
    ) -> np.ndarray:
        """Draw centroids (count, 2) about the other's place, the first exactly there."""
        return _about(_before(references[0]), MAX_SWAPPED_OFF, count, rng)

    def margins(
        self, figures: Candidates, references: Sequence[Figure], part: RelationPart, table: Table
    ) -> np.ndarray:
        """Return how near (C,) the centroids are to the other's place."""
        off = np.linalg.norm(figures.centroids - _before(references[0]), axis=1)
        return within(off, -math.inf, MAX_SWAPPED_OFF, MAX_SWAPPED_OFF)


def _before(figure: Figure) -> np.ndarray:
    (index,) = figure.members
    return figure.standing.before[index]


def _about(place: np.ndarray, limit: float, count: int, rng: np.random.Generator) -> np.ndarray:
    spread = _DRAWN * limit * rng.uniform(-1.0, 1.0, (count, 2))
    spread[:1] = 0.0
    return place + spread
