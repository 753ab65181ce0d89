"""The checks of a structure's keys besides its slots (evaluation protocol, part two)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from grounding.goals.parts import GoalError, StructurePart
from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import (
    MAX_ALONG_DISTANCE,
    MAX_ALONG_OFF_DEGREES,
    MAX_AROUND_OFF,
    MAX_UNNAMED_MOVE,
    MIN_GROUP_GAP,
)
from structdiffusion.footprints import clear_gap
from structdiffusion.observation import Table
from structdiffusion.relations.figure import Standing
from structdiffusion.structures import structure_named
from structdiffusion.structures.bodies import PlacedBody
from structdiffusion.structures.checks import Check, on_table_check, position_checks
from structdiffusion.structures.key_checks import check_keys
from structdiffusion.structures.keys import structure_keys

# The axis of the world frame across each edge of the table, 0 for x, and whether the edge is at its low end.
EDGE_AXES = {"near": (0, True), "far": (0, False), "left": (1, False), "right": (1, True)}


def key_checks(standing: Standing, part: StructurePart, members: Sequence[int]) -> list[Check]:
    """Check the keys of a structure, but for `group_by` (see `Grouping`).

    Args:
        standing: the bodies on the table.
        part: the structure.
        members: the indices of its objects.
    """
    bodies, checks = standing.among(members), []
    if part.around is not None:
        (index,) = part.around
        assert isinstance(index, int)
        centre, middle = structure_named(part.shape or "").centre(bodies), standing.bodies[index]
        off = float(np.linalg.norm(centre - middle.centroid))
        moved = float(np.linalg.norm(middle.centroid - standing.before[index]))
        checks += [
            Check(f"centre off the {middle.name} (m)", off <= MAX_AROUND_OFF, off, f"<= {MAX_AROUND_OFF:g}"),
            Check(f"move of the {middle.name} (m)", moved <= MAX_UNNAMED_MOVE, moved, f"<= {MAX_UNNAMED_MOVE:g}"),
        ]
    if part.along is not None:
        checks += _along_checks(bodies, part.along, standing.table)
    return checks + (check_keys(bodies, part.spec, structure_keys(part)) if part.shape is not None else [])


def edge_distance(points: np.ndarray, edge: str, table: Table) -> np.ndarray:
    """Return how far points (..., 2) are from an edge of the table, metres."""
    axis, low = EDGE_AXES[edge]
    ends = ((table.x_min, table.x_max), (table.y_min, table.y_max))[axis]
    return points[..., axis] - ends[0] if low else ends[1] - points[..., axis]


def _along_checks(bodies: Sequence[PlacedBody], edge: str, table: Table) -> list[Check]:
    """Check that a line is parallel to an edge of the table, and near it."""
    points = np.array([body.centroid for body in bodies])
    direction = np.linalg.svd(points - points.mean(axis=0))[2][0]
    off = math.degrees(math.asin(min(1.0, abs(float(direction[EDGE_AXES[edge][0]])))))
    farthest = float(edge_distance(points, edge, table).max())
    return [
        Check(f"line off the {edge} edge (deg)", off <= MAX_ALONG_OFF_DEGREES, off, f"<= {MAX_ALONG_OFF_DEGREES:g}"),
        Check(
            f"distance to the {edge} edge (m)", farthest <= MAX_ALONG_DISTANCE, farthest, f"<= {MAX_ALONG_DISTANCE:g}"
        ),
    ]


@dataclass(frozen=True)
class Grouping:
    """By which values objects are grouped.

    Attributes:
        colors: the name of each object's colour, or `None` where colours are not known.
    """

    colors: Sequence[str] | None = None

    def groups(self, kinds: Sequence[str], members: Sequence[int], by: str) -> dict[str, list[int]]:
        """Return which of the members, by their place among them, have each value.

        Args:
            kinds: the noun of each member.
            members: the index of each member.
            by: one of `grounding.goals.parts.GROUPINGS`.

        Raises:
            GoalError: if the colours are asked for and not known.
        """
        values = dict(zip(members, kinds, strict=True))
        if by == "colour":
            if self.colors is None:
                raise GoalError("objects cannot be grouped by colour here: their colours are not known")
            values = {index: self.colors[index] for index in members}
        groups: dict[str, list[int]] = {}
        for place, index in enumerate(members):
            groups.setdefault(values[index], []).append(place)
        return groups

    def checks(
        self, bodies: Sequence[PlacedBody], members: Sequence[int], part: StructurePart, table: Table
    ) -> list[Check]:
        """Check that each value has one structure by itself, and that these are apart;
        the place holds for the whole.
        """
        assert part.group_by is not None and part.shape is not None
        structure = structure_named(part.shape)
        groups = self.groups([body.category for body in bodies], members, part.group_by)
        checks = []
        for value, places in groups.items():
            if len(places) >= structure.least:
                own = structure.check([bodies[i] for i in places], StructureSpec(part.shape, part.size), table)
                checks += [Check(f"{value}: {check.name}", check.passed, check.measured, check.limit) for check in own]
        gaps = [
            clear_gap(bodies[i].footprint, bodies[j].footprint)
            for one, other in combinations(groups.values(), 2)
            for i in one
            for j in other
        ]
        if gaps:
            least = min(gaps)
            checks.append(Check("clear gap between groups (m)", least >= MIN_GROUP_GAP, least, f">= {MIN_GROUP_GAP:g}"))
        checks.append(on_table_check(bodies))
        centre = structure.centre(bodies)
        placed = StructureSpec(x_position=part.x_position, y_position=part.y_position)
        return checks + position_checks(bodies, centre, placed, table)
