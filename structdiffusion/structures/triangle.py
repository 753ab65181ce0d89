"""The triangle: objects at three corners, and evenly along the sides between them, a corner toward its heading.

Object i takes place i, counter-clockwise from the corner at the heading.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import (
    MAX_CORNER_OFF_DEGREES,
    MIN_TRIANGLE_OBJECTS,
    TRIANGLE_ANGLES_DEGREES,
)
from structdiffusion.footprints import separation_along, turned
from structdiffusion.geometry import HEADING_OF_ROTATION, wrap_angle
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.checks import (
    HEADING_MEASURE,
    Check,
    count_check,
    heading_check,
    on_table_check,
    position_checks,
    size_checks,
)
from structdiffusion.structures.gaps import best_order, draft_with_gap
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.polygons import (
    EVEN_OUTLINE,
    fit_triangle,
    inner_angles,
    order_along,
    outline_checks,
    pairs_around,
    places_on,
)
from structdiffusion.structures.rectangle import between_corners, sides_of
from structdiffusion.structures.spread import SpreadStructure, draft_on_places, outward_axes, rotated, spread_ratio
from structdiffusion.structures.structure import Draft

# Base over leg of the isosceles triangles that are drawn. With objects between the corners of the legs alone, a shorter
# base keeps its gap near the mean.
_BASE, _BASE_WITHOUT_OBJECTS = 1.0, 0.85
_ANGLE_MARGIN = 4.0  # degrees inside the legal angles, of triangles of requested gaps
_ROUNDS = 3  # of measuring gaps along sides whose lengths follow from them


class Triangle(SpreadStructure):
    """Three or more objects on the outline of a triangle."""

    name = "triangle"
    least = MIN_TRIANGLE_OBJECTS
    usual_counts = (3, 7)
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
        """Draw a triangle in which long objects lie away from its centre.

        Raises:
            LayoutError: for fewer than three objects, or a gap that they cannot have.
        """
        self.require_enough(items)
        each, more = divmod(len(items) - 3, 3)
        # Sides in order: a leg, the base, the other leg.
        inner = {0: (each, each, each), 1: (each, each + 1, each), 2: (each + 1, each, each + 1)}[more]
        if keys.gap is not None:
            return self._with_gap(items, inner, spec, heading, rng, keys.gap)
        base = _BASE_WITHOUT_OBJECTS if more == 2 and each == 0 else _BASE
        height = math.sqrt(1.0 - (base / 2) ** 2)
        corners = np.array([(height, 0.0), (0.0, base / 2), (0.0, -base / 2)])
        corners -= corners.mean(axis=0)
        places = rotated(between_corners(corners, inner), heading)
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
        """Draw a triangle with one clear gap between neighbours, whose sides are as long as their objects need."""
        turns = np.array([item.turn_to_axis(heading) for item in items])
        outlines = [turned(item.footprint, turn) for item, turn in zip(items, turns)]
        members = sides_of(inner)

        def laid(order: Sequence[int]) -> tuple[np.ndarray, float] | None:
            """Return places (N, 2) about the centre, and by how much gaps are off; `None` for no legal triangle."""
            corners = np.array([(math.cos(yaw), math.sin(yaw)) for yaw in heading + np.radians([0.0, 120.0, 240.0])])
            steps: list[np.ndarray] = []
            for _ in range(_ROUNDS):
                ways = np.roll(corners, -1, axis=0) - corners
                ways /= np.linalg.norm(ways, axis=1, keepdims=True)
                before, steps = steps, []
                for way, places in zip(ways, members):
                    chosen = [outlines[order[place]] for place in places]
                    steps.append(np.array([separation_along(a, b, way, gap) for a, b in zip(chosen, chosen[1:])]))
                lengths = [float(step.sum()) for step in steps]
                if 2 * max(lengths) >= sum(lengths):
                    return None
                corners = _corners_of(lengths, heading)
            angles, every = inner_angles(corners), np.concatenate(steps)
            legal = TRIANGLE_ANGLES_DEGREES[0] + _ANGLE_MARGIN, TRIANGLE_ANGLES_DEGREES[1] - _ANGLE_MARGIN
            if angles.min() < legal[0] or angles.max() > legal[1] or every.max() > EVEN_OUTLINE * every.mean():
                return None
            ways = np.roll(corners, -1, axis=0) - corners
            ways /= np.linalg.norm(ways, axis=1, keepdims=True)
            places = [
                start + np.concatenate(([0.0], np.cumsum(step)[:-1]))[:, None] * way
                for start, way, step in zip(corners, ways, steps)
            ]
            return np.concatenate(places), max(float(np.abs(a - b).max()) for a, b in zip(steps, before))

        def error(order: Sequence[int]) -> float:
            found = laid(order)
            return math.inf if found is None else found[1]

        order = best_order(len(items), error, gap, self.name, rng)
        offsets, own = laid(order)[0], [outlines[i] for i in order]  # type: ignore[index]
        return draft_with_gap(self.name, spec, order, own, offsets, turns[list(order)], heading, gap)

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check the outline, corners, angles, gaps, heading and size, and that all objects stand on the table."""
        checks = [count_check(bodies, self.name, self.least)]
        if len(bodies) < self.least:
            return checks
        points = np.array([body.centroid for body in bodies])
        corners = fit_triangle(points)
        checks += outline_checks(points, corners)
        angles, (low, high) = inner_angles(corners), TRIANGLE_ANGLES_DEGREES
        smallest, largest = float(angles.min()), float(angles.max())
        checks.append(Check("smallest angle (deg)", smallest >= low, smallest, f">= {low:g}"))
        checks.append(Check("largest angle (deg)", largest <= high, largest, f"<= {high:g}"))
        checks.append(on_table_check(bodies))
        centre = corners.mean(axis=0)
        if spec.rotation is not None:
            headings = np.arctan2(*(corners - centre).T[::-1])
            nearest = headings[np.abs(wrap_angle(headings - HEADING_OF_ROTATION[spec.rotation])).argmin()]
            name = f"nearest corner's {HEADING_MEASURE} (deg off)"
            checks.append(heading_check(name, float(nearest), spec.rotation, MAX_CORNER_OFF_DEGREES))
        if spec.size is not None:
            checks += size_checks(spread_ratio(bodies), spec)
        return checks + position_checks(bodies, centre, spec, table)

    def exact_places(self, points: np.ndarray) -> np.ndarray:
        """Return places (N, 2) at the corners and along the sides of the triangle nearest to centroids (N, 2)."""
        return places_on(points, fit_triangle(points))

    def sequence(self, bodies: Sequence[PlacedBody]) -> list[int]:
        """Return the bodies' indices along the outline, counter-clockwise."""
        points = np.array([body.centroid for body in bodies])
        return order_along(points, fit_triangle(points))

    def neighbours(self, bodies: Sequence[PlacedBody], spec: StructureSpec) -> list[tuple[int, int]]:
        """Return each body and the next one along the outline, all the way round."""
        return pairs_around(self.sequence(bodies))

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the centroid (2,) of the least-squares triangle; of fewer than three objects, the mean."""
        if len(bodies) < self.least:
            return super().centre(bodies)
        return fit_triangle(np.array([body.centroid for body in bodies])).mean(axis=0)


def _corners_of(lengths: Sequence[float], heading: float) -> np.ndarray:
    """Return the corners (3, 2), counter-clockwise about their mean, of a triangle of sides (m), the first toward a
    heading.
    """
    first, second, third = lengths  # from corner 0 to 1, 1 to 2, and 2 to 0
    cosine = (first**2 + third**2 - second**2) / (2 * first * third)
    angle = math.acos(max(-1.0, min(1.0, cosine)))
    corners = np.array([(0.0, 0.0), (first, 0.0), (third * math.cos(angle), third * math.sin(angle))])
    corners -= corners.mean(axis=0)
    return turned(corners, heading - math.atan2(corners[0, 1], corners[0, 0]))
