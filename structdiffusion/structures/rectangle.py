"""The rectangle and the square: objects at four corners, and evenly along the sides between them. They face nowhere.

Object i takes place i, counter-clockwise from a corner, the first side being one of the longer ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import MAX_SQUARE_SIDES_SHARE, MIN_RECTANGLE_OBJECTS
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.checks import Check, count_check, on_table_check, position_checks, size_checks
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.polygons import fit_rectangle, outline_checks, side_lengths
from structdiffusion.structures.spread import SpreadStructure, draft_on_places, outward_axes, rotated, spread_ratio
from structdiffusion.structures.structure import Draft

_ASPECT = (1.35, 1.7)  # of the sides of a rectangle of four objects, which no others keep apart
# Shorter over longer side of a square that has one side without an object between its corners and three with one: even
# sides would leave a gap of 1.75 times the mean.
_SQUARE_OF_SEVEN = 0.87


class Rectangle(SpreadStructure):
    """Four or more objects on the outline of a rectangle."""

    name = "rectangle"
    least = MIN_RECTANGLE_OBJECTS
    usual_counts = (4, 8)

    def draft(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys = NO_KEYS,
    ) -> Draft:
        """Draw a rectangle along the table's edges, in which long objects lie away from its centre.

        Raises:
            LayoutError: for fewer than four objects.
        """
        self.require_enough(items)
        heading = rng.integers(4) * math.pi / 2
        inner, sides = self._sides(len(items), rng)
        places = rotated(_along_sides(inner, sides), heading)
        return draft_on_places(items, places, outward_axes(places), spec, heading, rng)

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check the outline, its corners and gaps, size, and that all stand on the table."""
        checks = [count_check(bodies, self.name, self.least)]
        if len(bodies) < self.least:
            return checks
        points = np.array([body.centroid for body in bodies])
        corners = fit_rectangle(points)
        checks += outline_checks(points, corners)
        checks += self._side_checks(side_lengths(corners))
        checks.append(on_table_check(bodies))
        if spec.size is not None:
            checks += size_checks(spread_ratio(bodies), spec)
        return checks + position_checks(bodies, corners.mean(axis=0), spec, table)

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the centre (2,) of the least-squares rectangle; of fewer than four objects, the mean."""
        if len(bodies) < self.least:
            return super().centre(bodies)
        return fit_rectangle(np.array([body.centroid for body in bodies])).mean(axis=0)

    def has_heading(self, bodies: Sequence[PlacedBody]) -> bool:
        """Return that it faces nowhere."""
        return False

    def _sides(self, count: int, rng: np.random.Generator) -> tuple[tuple[int, ...], tuple[float, float]]:
        """Return how many objects stand between the corners of each side, and the lengths of the longer and shorter sides."""
        between = count - 4
        short = (between // 2) // 3  # of each shorter side: a third of what the longer ones have, rounded down
        long = between - 2 * short
        first, third = -(-long // 2), long // 2
        if between == 0:
            return (0, 0, 0, 0), (float(rng.uniform(*_ASPECT)), 1.0)
        return (first, short, third, short), ((first + third) / 2 + 1.0, short + 1.0)

    def _side_checks(self, sides: np.ndarray) -> list[Check]:
        """Check what the sides (4,) of the least-squares rectangle have to keep."""
        return []


class Square(Rectangle):
    """A rectangle whose sides are about equal."""

    name = "square"

    def _sides(self, count: int, rng: np.random.Generator) -> tuple[tuple[int, ...], tuple[float, float]]:
        each, more = divmod(count - 4, 4)
        inner = {0: (each,) * 4, 1: (each + 1, each, each, each), 2: (each + 1, each, each + 1, each)}
        if more == 3:
            shorter = _SQUARE_OF_SEVEN if each == 0 else 1.0
            return (each + 1, each + 1, each + 1, each), (1.0, shorter)
        return inner[more], (1.0, 1.0)

    def _side_checks(self, sides: np.ndarray) -> list[Check]:
        differ, limit = float(np.ptp(sides) / sides.max()), MAX_SQUARE_SIDES_SHARE
        return [Check("difference of the sides / longer side", differ <= limit, differ, f"<= {limit:g}")]


def _along_sides(inner: Sequence[int], sides: tuple[float, float]) -> np.ndarray:
    """Return places (N, 2) about the centre: the corners, and evenly between them, counter-clockwise."""
    a, b = sides[0] / 2, sides[1] / 2
    corners = np.array([(-a, -b), (a, -b), (a, b), (-a, b)])
    return between_corners(corners, inner)


def between_corners(corners: np.ndarray, inner: Sequence[int]) -> np.ndarray:
    """Return the corners (C, 2) of a polygon with so many places evenly between each and the next, in order: (N, 2)."""
    places = []
    for number, count in enumerate(inner):
        start, end = corners[number], corners[(number + 1) % len(corners)]
        places += [start + (end - start) * k / (count + 1) for k in range(count + 1)]
    return np.array(places)
