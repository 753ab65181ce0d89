"""The arc: objects along a part of a circle, whose open side is its heading.

Object i takes place i, counter-clockwise from one end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import (
    ARC_DEGREES,
    MAX_ARC_OFF_DEGREES,
    MAX_GAP_RATIO,
    MIN_ARC_OBJECTS,
    max_off_circle,
)
from structdiffusion.footprints import fit_circle
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
from structdiffusion.structures.circle import angular_gaps
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.spread import SpreadStructure, draft_on_places, outward_axes, spread_ratio
from structdiffusion.structures.structure import Draft

_DRAWN_DEGREES = (160.0, 205.0)  # what an arc spans: well inside `ARC_DEGREES`


class Arc(SpreadStructure):
    """Three or more objects on an arc, about half a circle."""

    name = "arc"
    least = MIN_ARC_OBJECTS
    usual_counts = (3, 7)

    def draft(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys = NO_KEYS,
    ) -> Draft:
        """Draw an arc in which long objects lie along the radius.

        Raises:
            LayoutError: for fewer than three objects.
        """
        self.require_enough(items)
        span = math.radians(rng.uniform(*_DRAWN_DEGREES))
        angles = heading + math.pi + np.linspace(-span / 2, span / 2, len(items))
        places = np.column_stack((np.cos(angles), np.sin(angles)))
        return draft_on_places(items, places, outward_axes(places), spec, heading, rng)

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check roundness, what it spans, its inner gaps, where it is open, size, and that all stand on the table."""
        checks = [count_check(bodies, self.name, self.least)]
        if len(bodies) < self.least:
            return checks
        points = np.array([body.centroid for body in bodies])
        centre, radius = fit_circle(points)
        offsets = points - centre
        worst, allowed = float(np.abs(np.linalg.norm(offsets, axis=1) - radius).max()), max_off_circle(radius)
        checks.append(Check("distance to the circle (m)", worst <= allowed, worst, f"<= {allowed:.3f}"))
        angles, gaps = angular_gaps(offsets)
        largest = int(gaps.argmax())
        span, (low, high) = math.degrees(2 * math.pi - gaps[largest]), ARC_DEGREES
        checks.append(Check("span of the arc (deg)", low <= span <= high, span, f"{low:g} to {high:g}"))
        inner = np.delete(gaps, largest)
        ratio = float(inner.max() / max(inner.mean(), 1e-9))
        checks.append(Check("largest inner gap / mean inner gap", ratio <= MAX_GAP_RATIO, ratio, f"<= {MAX_GAP_RATIO:g}"))
        checks.append(on_table_check(bodies))
        if spec.rotation is not None:
            middle = float(angles[largest] + gaps[largest] / 2)
            name = f"open side's {HEADING_MEASURE} (deg off)"
            checks.append(heading_check(name, middle, spec.rotation, MAX_ARC_OFF_DEGREES))
        if spec.size is not None:
            checks += size_checks(spread_ratio(bodies), spec)
        return checks + position_checks(bodies, centre, spec, table)

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the centre (2,) of the least-squares circle; of fewer than three objects, the mean."""
        if len(bodies) < self.least:
            return super().centre(bodies)
        return fit_circle(np.array([body.centroid for body in bodies]))[0]

    def has_heading(self, bodies: Sequence[PlacedBody]) -> bool:
        """Return whether there are objects enough for an arc."""
        return len(bodies) >= self.least
