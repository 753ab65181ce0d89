"""The keys of a structure besides its slots (evaluation protocol, part two)."""

from __future__ import annotations

from dataclasses import dataclass

from grounding.goals.parts import Order, StructurePart


@dataclass(frozen=True)
class StructureKeys:
    """The requested keys of a structure besides its slots; `None` if not requested.

    Attributes:
        order: the order of the objects; "listed" is the order in which they are given.
        gap: clear distance between neighbours, metres.
        radius: of a circle or an arc, to the centroids, metres.
        length: of a line, between the centroids at its ends, metres.
        rows: of a grid; rows run left to right, along y.
        columns: of a grid.
        along: the edge of the table that a line runs along, one of `grounding.goals.parts.EDGES`.
    """

    order: Order | None = None
    gap: float | None = None
    radius: float | None = None
    length: float | None = None
    rows: int | None = None
    columns: int | None = None
    along: str | None = None


NO_KEYS = StructureKeys()


def structure_keys(part: StructurePart) -> StructureKeys:
    """Return the keys of a goal's structure besides its slots."""
    return StructureKeys(part.order, part.gap, part.radius, part.length, part.rows, part.columns, part.along)
