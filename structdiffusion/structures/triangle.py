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
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.polygons import fit_triangle, inner_angles, outline_checks
from structdiffusion.structures.rectangle import between_corners
from structdiffusion.structures.spread import SpreadStructure, draft_on_places, outward_axes, rotated, spread_ratio
from structdiffusion.structures.structure import Draft

# Base over leg of the isosceles triangles that are drawn. With objects between the corners of the legs alone, a shorter base
# keeps its gap near the mean.
_BASE, _BASE_WITHOUT_OBJECTS = 1.0, 0.85


class Triangle(SpreadStructure):
    """Three or more objects on the outline of a triangle."""

    name = "triangle"
    least = MIN_TRIANGLE_OBJECTS
    usual_counts = (3, 7)

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
            LayoutError: for fewer than three objects.
        """
        self.require_enough(items)
        each, more = divmod(len(items) - 3, 3)
        # Sides in order: a leg, the base, the other leg.
        inner = {0: (each, each, each), 1: (each, each + 1, each), 2: (each + 1, each, each + 1)}[more]
        base = _BASE_WITHOUT_OBJECTS if more == 2 and each == 0 else _BASE
        height = math.sqrt(1.0 - (base / 2) ** 2)
        corners = np.array([(height, 0.0), (0.0, base / 2), (0.0, -base / 2)])
        corners -= corners.mean(axis=0)
        places = rotated(between_corners(corners, inner), heading)
        return draft_on_places(items, places, outward_axes(places), spec, heading, rng)

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check the outline, its corners, angles and gaps, where a corner points, size, and that all stand on the table."""
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

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the centroid (2,) of the least-squares triangle; of fewer than three objects, the mean."""
        if len(bodies) < self.least:
            return super().centre(bodies)
        return fit_triangle(np.array([body.centroid for body in bodies])).mean(axis=0)

    def has_heading(self, bodies: Sequence[PlacedBody]) -> bool:
        """Return whether there are objects enough for corners."""
        return len(bodies) >= self.least
