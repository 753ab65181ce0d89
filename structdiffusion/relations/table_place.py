"""At: an object in a region of the table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from grounding.goals.parts import RelationPart
from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import X_POSITION_THIRDS, Y_POSITION_THIRDS
from structdiffusion.footprints import centre_range
from structdiffusion.observation import Table
from structdiffusion.relations.candidates import Candidates
from structdiffusion.relations.figure import Figure
from structdiffusion.relations.relation import Relation, within
from structdiffusion.structures.checks import Check, position_checks

_DRAWN = 0.2  # share of a third that is kept from its borders where places are drawn
_SURE = 0.06  # share of the range inside a third, from where on more is no better


class At(Relation):
    """An object in thirds of the range in which it can lie."""

    name = "at"
    references = 0

    def check(self, figure: Figure, references: Sequence[Figure], part: RelationPart) -> list[Check]:
        """Check the thirds in which the object lies."""
        return position_checks(figure.bodies, figure.centroid, _spec(part), figure.standing.table)

    def sample(
        self,
        figure: Figure,
        references: Sequence[Figure],
        part: RelationPart,
        count: int,
        rng: np.random.Generator,
    ) -> np.ndarray:
        """Draw centroids (count, 2) inside the thirds."""
        ranges = centre_range([figure.outline], figure.centroid, figure.standing.table)
        columns = []
        for (low, high), (value, names) in zip(ranges, _asked(part), strict=True):
            if value is not None:
                third = (high - low) / 3
                start = low + names.index(value) * third
                low, high = start + _DRAWN * third, start + (1 - _DRAWN) * third
            columns.append(rng.uniform(min(low, high), max(low, high), count))
        return np.column_stack(columns)

    def margins(
        self, figures: Candidates, references: Sequence[Figure], part: RelationPart, table: Table
    ) -> np.ndarray:
        """Return the smaller of the margins (C,) of the thirds asked for."""
        margins = np.ones(len(figures.centroids))
        ranges = centre_range([figures.outline], np.zeros(2), table)
        for axis, (value, names) in enumerate(_asked(part)):
            if value is None:
                continue
            low, high = ranges[axis]
            share = (figures.centroids[:, axis] - low) / max(1e-6, high - low)
            third = names.index(value)
            margins = np.minimum(margins, within(share, third / 3, (third + 1) / 3, _SURE))
        return margins


def _spec(part: RelationPart) -> StructureSpec:
    return StructureSpec(x_position=part.x_position, y_position=part.y_position)


def _asked(part: RelationPart) -> tuple[tuple[str | None, tuple[str, ...]], ...]:
    """Return the third asked for along x of the world frame, then along y, each with all names."""
    return (part.y_position, Y_POSITION_THIRDS), (part.x_position, X_POSITION_THIRDS)
