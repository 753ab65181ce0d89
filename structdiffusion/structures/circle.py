"""The circle: a ring of objects, open toward its heading where it has one.

Object i takes place i, counter-clockwise from the opening.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import (
    MAX_GAP_RATIO,
    MAX_OPENING_OFF_DEGREES,
    MIN_CIRCLE_OBJECTS,
    OPENING_RATIO,
    max_off_circle,
)
from structdiffusion.footprints import fit_circle, tightest_ring_radius, turned
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.checks import (
    Check,
    count_check,
    heading_check,
    on_table_check,
    position_checks,
    size_checks,
)
from structdiffusion.structures.sizes import clip_to_size, draw_size_ratio
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.structure import Draft, Structure

# The opening of a ring that faces somewhere, over its other gaps: well inside `OPENING_RATIO`.
_DRAWN_OPENING = (1.9, 2.4)
_KEPT = 0.6  # of what the evaluation protocol lets objects be off the ring: what is off by more is moved in


class Circle(Structure):
    """Three or more objects on a circle."""

    name = "circle"
    least = MIN_CIRCLE_OBJECTS
    usual_counts = (3, 7)
    rotation_alters_layout = True
    often_one_noun = True
    demonstration_share = 0.25
    crowded_share = 0.4

    def draft(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys = NO_KEYS,
    ) -> Draft:
        """Draw a ring in which long objects lie along the radius.

        Raises:
            LayoutError: for fewer than three objects.
        """
        self.require_enough(items)
        count = len(items)
        opening = rng.uniform(*_DRAWN_OPENING) if spec.rotation else 1.0
        gap = 2 * math.pi / (count - 1 + opening)
        angles = heading + opening * gap / 2 + gap * np.arange(count)
        directions = np.column_stack((np.cos(angles), np.sin(angles)))
        turns = np.array([item.turn_to_axis(angle) for item, angle in zip(items, angles)])
        outlines = [turned(item.footprint, turn) for item, turn in zip(items, turns)]
        radius = draw_size_ratio(spec, rng) * tightest_ring_radius(outlines, directions)
        return Draft(tuple(range(count)), radius * directions, np.zeros(count), turns, heading)

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check roundness, gaps, the opening toward the heading, size, and that all stand on the table."""
        checks = [count_check(bodies, self.name, self.least)]
        if len(bodies) < self.least:
            return checks
        points = np.array([body.centroid for body in bodies])
        centre, radius = fit_circle(points)
        offsets = points - centre
        worst = float(np.abs(np.linalg.norm(offsets, axis=1) - radius).max())
        allowed = max_off_circle(radius)
        checks.append(Check("distance to the circle (m)", worst <= allowed, worst, f"<= {allowed:.3f}"))
        checks += _gap_checks(offsets, spec)
        directions = offsets / np.linalg.norm(offsets, axis=1, keepdims=True)
        tightest = tightest_ring_radius([body.local_footprint for body in bodies], directions)
        # Objects in a straight line lie on a circle of any size, all in one direction from its centre.
        checks += size_checks(radius / max(tightest, 1e-9), spec)
        checks.append(on_table_check(bodies))
        return checks + position_checks(bodies, centre, spec, table)

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the centre (2,) of the least-squares circle; of fewer than three objects, the mean."""
        if len(bodies) < self.least:
            return super().centre(bodies)
        return fit_circle(np.array([body.centroid for body in bodies]))[0]

    def has_heading(self, bodies: Sequence[PlacedBody]) -> bool:
        """Return whether the ring is open: one that is closed faces nowhere."""
        if len(bodies) < self.least:
            return False
        points = np.array([body.centroid for body in bodies])
        return _opening_ratio(angular_gaps(points - fit_circle(points)[0])[1]) >= OPENING_RATIO[0]

    def corrections(self, bodies: Sequence[PlacedBody], size: str | None) -> np.ndarray:
        """Return how far (N, 2), metres, each body moves along its radius: into the size's band, and near the ring."""
        if len(bodies) < self.least:
            return super().corrections(bodies, size)
        centre, radius = fit_circle(np.array([body.centroid for body in bodies]))
        offsets = np.array([body.centroid for body in bodies]) - centre
        distances = np.linalg.norm(offsets, axis=1)
        directions = offsets / distances[:, None]
        tightest = tightest_ring_radius([body.local_footprint for body in bodies], directions)
        wanted = clip_to_size(radius, tightest, size)
        most = _KEPT * max_off_circle(wanted)
        return (wanted + np.clip(distances - radius, -most, most) - distances)[:, None] * directions


def angular_gaps(offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the angles (N,) of objects about the centre, sorted, and the gap (N,) that follows each, radians."""
    angles = np.sort(np.arctan2(offsets[:, 1], offsets[:, 0]))
    return angles, np.diff(np.append(angles, angles[0] + 2 * math.pi))


def _opening_ratio(gaps: np.ndarray) -> float:
    """Return the largest gap over the mean of the others."""
    largest = int(gaps.argmax())
    return float(gaps[largest] / max(np.delete(gaps, largest).mean(), 1e-9))


def _gap_checks(offsets: np.ndarray, spec: StructureSpec) -> list[Check]:
    """Check that the ring is closed; with a rotation, that it is open toward it."""
    angles, gaps = angular_gaps(offsets)
    largest = int(gaps.argmax())
    if spec.rotation is None:
        ratio = float(gaps[largest] / gaps.mean())
        return [Check("largest gap / mean gap", ratio <= MAX_GAP_RATIO, ratio, f"<= {MAX_GAP_RATIO:g}")]
    ratio, (low, high) = _opening_ratio(gaps), OPENING_RATIO
    middle = angles[largest] + gaps[largest] / 2
    return [
        Check("opening / mean of the other gaps", low <= ratio <= high, ratio, f"{low:g} to {high:g}"),
        heading_check("opening's heading (deg off)", middle, spec.rotation, MAX_OPENING_OFF_DEGREES),
    ]
