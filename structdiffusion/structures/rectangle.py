"""The rectangle and the square: objects at four corners, and evenly along the sides between them. They face nowhere.

Object i takes place i, counter-clockwise from a corner, the first side being one of the longer ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import MAX_SQUARE_SIDES_SHARE, MIN_RECTANGLE_OBJECTS
from structdiffusion.footprints import turned
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.checks import Check, count_check, on_table_check, position_checks, size_checks
from structdiffusion.structures.gaps import best_order, chain, draft_with_gap, separations
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.polygons import (
    EVEN_OUTLINE,
    fit_rectangle,
    order_along,
    outline_checks,
    pairs_around,
    places_on,
    side_lengths,
)
from structdiffusion.structures.spread import SpreadStructure, draft_on_places, outward_axes, rotated, spread_ratio
from structdiffusion.structures.structure import Draft

_ASPECT = (1.35, 1.7)  # of the sides of a rectangle of four objects, which no others keep apart
# Shorter over longer side of a square that has one side without an object between its corners and three with one: even
# sides would leave a gap of 1.75 times the mean.
_SQUARE_OF_SEVEN = 0.87
_DRAWN_SIDES = 0.07  # share by which the sides of a square of requested gaps may differ from their mean


class Rectangle(SpreadStructure):
    """Four or more objects on the outline of a rectangle."""

    name = "rectangle"
    least = MIN_RECTANGLE_OBJECTS
    usual_counts = (4, 8)
    demonstration_share = 0.17
    crowded_share = 0.1

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
            LayoutError: for fewer than four objects, or a gap that they cannot have.
        """
        self.require_enough(items)
        heading = rng.integers(4) * math.pi / 2
        inner, sides = self._sides(len(items), rng)
        if keys.gap is not None:
            return self._with_gap(items, inner, spec, heading, rng, keys.gap)
        places = rotated(_along_sides(inner, sides), heading)
        return draft_on_places(items, places, outward_axes(places), spec, heading, rng)

    def _with_gap(
        self,
        items: Sequence[LayoutItem],
        inner: Sequence[int],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        gap: float,
    ) -> Draft:
        """Draw a rectangle with one clear gap between neighbours, with objects so distributed that opposite sides
        match.
        """
        turns = np.array([item.turn_to_axis(heading) for item in items])
        outlines = [turned(item.footprint, turn) for item, turn in zip(items, turns)]
        along = np.array([math.cos(heading), math.sin(heading)])
        axes = [separations(outlines, axis, gap) for axis in (along, np.array([-along[1], along[0]]))]
        members = sides_of(inner)

        def needed(order: Sequence[int], number: int) -> np.ndarray:
            """Return the distances from object to object along a side."""
            chosen = [order[place] for place in members[number]]
            # The third and the fourth side run against the axes.
            return chain(axes[number % 2], chosen) if number < 2 else chain(axes[number % 2], chosen[::-1])[::-1]

        def sides(order: Sequence[int]) -> tuple[np.ndarray, list[np.ndarray]]:
            """Return the lengths (2,) of the sides and the distances along each of the four from object to object."""
            steps = [needed(order, number) for number in range(4)]
            lengths = np.array([(steps[k].sum() + steps[k + 2].sum()) / 2 for k in (0, 1)])
            lengths = self._fitted_sides(lengths)
            return lengths, [step + (lengths[k % 2] - step.sum()) / len(step) for k, step in enumerate(steps)]

        def error(order: Sequence[int]) -> float:
            lengths, steps = sides(order)
            every = np.concatenate(steps)
            if every.min() <= 0 or every.max() > EVEN_OUTLINE * every.mean():
                return math.inf
            return max(float(np.abs(step - needed(order, number)).max()) for number, step in enumerate(steps))

        order = best_order(len(items), error, gap, self.name, rng)
        lengths, steps = sides(order)
        a, b = lengths / 2
        starts, ways = np.array([(-a, -b), (a, -b), (a, b), (-a, b)]), np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
        places = np.concatenate(
            [
                start + np.concatenate(([0.0], np.cumsum(step)[:-1]))[:, None] * way
                for start, way, step in zip(starts, ways, steps)
            ]
        )
        offsets, own = rotated(places, heading), [outlines[i] for i in order]
        return draft_with_gap(self.name, spec, order, own, offsets, turns[list(order)], heading, gap)

    def _fitted_sides(self, lengths: np.ndarray) -> np.ndarray:
        """Return the lengths (2,) of the sides nearest to these that the structure may have."""
        return lengths

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

    def exact_places(self, points: np.ndarray) -> np.ndarray:
        """Return places (N, 2) at the corners and along the sides of the rectangle nearest to centroids (N, 2)."""
        corners = fit_rectangle(points)
        lengths = side_lengths(corners)[:2]
        ways = np.array([corners[1] - corners[0], corners[3] - corners[0]]) / np.maximum(lengths, 1e-9)[:, None]
        half = self._fitted_sides(lengths) / 2
        fitted = corners.mean(axis=0) + half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) @ ways
        return places_on(points, fitted)

    def sequence(self, bodies: Sequence[PlacedBody]) -> list[int]:
        """Return the bodies' indices along the outline, counter-clockwise."""
        points = np.array([body.centroid for body in bodies])
        return order_along(points, fit_rectangle(points))

    def neighbours(self, bodies: Sequence[PlacedBody], spec: StructureSpec) -> list[tuple[int, int]]:
        """Return each body and the next one along the outline, all the way round."""
        return pairs_around(self.sequence(bodies))

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the centre (2,) of the least-squares rectangle; of fewer than four objects, the mean."""
        if len(bodies) < self.least:
            return super().centre(bodies)
        return fit_rectangle(np.array([body.centroid for body in bodies])).mean(axis=0)

    def _sides(self, count: int, rng: np.random.Generator) -> tuple[tuple[int, ...], tuple[float, float]]:
        """Return how many objects stand between the corners of each side, and the lengths of the longer and shorter
        sides.
        """
        between = count - 4
        short = (between // 2) // 3  # of each shorter side: a third of what the longer ones have, rounded down
        long = between - 2 * short
        first, third = -(-long // 2), long // 2
        if between == 0:
            return (0, 0, 0, 0), (float(rng.uniform(*_ASPECT)), 1.0)
        return (first, short, third, short), ((first + third) / 2 + 1.0, short + 1.0)

    def _side_checks(self, sides: np.ndarray) -> list[Check]:
        """Check the conditions on the sides (4,) of the least-squares rectangle."""
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

    def _fitted_sides(self, lengths: np.ndarray) -> np.ndarray:
        mean = float(lengths.mean())
        return np.clip(lengths, (1 - _DRAWN_SIDES) * mean, (1 + _DRAWN_SIDES) * mean)

    def _side_checks(self, sides: np.ndarray) -> list[Check]:
        differ, limit = float(np.ptp(sides) / sides.max()), MAX_SQUARE_SIDES_SHARE
        return [Check("difference of the sides / longer side", differ <= limit, differ, f"<= {limit:g}")]


def _along_sides(inner: Sequence[int], sides: tuple[float, float]) -> np.ndarray:
    """Return places (N, 2) about the centre: the corners, and evenly between them, counter-clockwise."""
    a, b = sides[0] / 2, sides[1] / 2
    corners = np.array([(-a, -b), (a, -b), (a, b), (-a, b)])
    return between_corners(corners, inner)


def sides_of(inner: Sequence[int]) -> list[list[int]]:
    """Return the places of each side of a polygon, corners included, as numbered by `between_corners`."""
    starts = np.concatenate(([0], np.cumsum(np.array(inner) + 1)))
    total = int(starts[-1])
    return [[(int(start) + k) % total for k in range(count + 2)] for start, count in zip(starts, inner)]


def between_corners(corners: np.ndarray, inner: Sequence[int]) -> np.ndarray:
    """Return the corners (C, 2) of a polygon with a number of even places between neighbouring ones, in order:
    (N, 2).
    """
    places = []
    for number, count in enumerate(inner):
        start, end = corners[number], corners[(number + 1) % len(corners)]
        places += [start + (end - start) * k / (count + 1) for k in range(count + 1)]
    return np.array(places)
