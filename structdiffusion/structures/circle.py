"""The circle: a ring of objects, open toward its heading if it has one.

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
    MAX_RADIUS_OFF,
    MIN_CIRCLE_OBJECTS,
    OPENING_RATIO,
    max_off_circle,
)
from structdiffusion.footprints import tightest_ring_radius, turned
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
from structdiffusion.structures.gaps import KEPT, require_clear, require_size, ring_angles
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.rings import RingStructure, angular_gaps, fit_ring, radius_with_room, roundness_check
from structdiffusion.structures.sizes import clip_to_size, draw_size_ratio
from structdiffusion.structures.structure import Draft, LayoutError

# The opening of a ring that faces somewhere, over its other gaps: well inside `OPENING_RATIO`.
_DRAWN_OPENING = (1.9, 2.4)
_EVEN = 0.95  # of the largest gap ratio that the evaluation protocol allows, up to which layouts go
_KEPT = 0.6  # of what the evaluation protocol lets objects be off the ring: what is off by more is moved in


class Circle(RingStructure):
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
            LayoutError: for fewer than three objects, or a radius or gap that these objects cannot have.
        """
        self.require_enough(items)
        if keys.gap is not None:
            return self._with_gap(items, spec, heading, rng, keys)
        count = len(items)
        opening = rng.uniform(*_DRAWN_OPENING) if spec.rotation else 1.0
        gap = 2 * math.pi / (count - 1 + opening)
        angles = heading + opening * gap / 2 + gap * np.arange(count)
        directions = np.column_stack((np.cos(angles), np.sin(angles)))
        turns = np.array([item.turn_to_axis(angle) for item, angle in zip(items, angles)])
        outlines = [turned(item.footprint, turn) for item, turn in zip(items, turns)]
        tightest = tightest_ring_radius(outlines, directions)
        if keys.radius is None:
            radius = draw_size_ratio(spec, rng) * tightest
        else:
            radius = radius_with_room(self.name, keys.radius, tightest)
            require_size(self.name, spec.size, radius / tightest, f"a radius of {radius:.3g} m")
        return Draft(tuple(range(count)), radius * directions, np.zeros(count), turns, heading)

    def _with_gap(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys,
    ) -> Draft:
        """Draw a ring with one clear gap between neighbours, and an opening if it faces anywhere."""
        assert keys.gap is not None
        ratio = rng.uniform(*_DRAWN_OPENING) if spec.rotation else None
        if ratio is None:
            angles, radius, turns = ring_angles(items, keys.gap, lambda steps: heading, lambda steps: 2 * math.pi)
        else:
            angles, radius, turns = ring_angles(
                items, keys.gap,
                lambda steps: heading + ratio * float(steps[:-1].mean()) / 2,
                lambda steps: 2 * math.pi - ratio * float(steps[:-1].mean()) + float(steps[-1]),
            )  # fmt: skip
        why = f"gaps of {keys.gap:.3g} m"
        if keys.radius is not None and abs(radius - keys.radius) > KEPT * MAX_RADIUS_OFF:
            raise LayoutError(
                f"a circle of these objects with {why} has a radius of {radius:.3f} m, not {keys.radius:.3g} m: leave "
                "one of "
                "them open"
            )
        offsets = radius * np.column_stack((np.cos(angles), np.sin(angles)))
        gaps = angular_gaps(offsets)[1]
        if ratio is None and gaps.max() > _EVEN * MAX_GAP_RATIO * gaps.mean():
            raise LayoutError(f"objects of such different sizes cannot form an even circle with {why}")
        outlines = [turned(item.footprint, turn) for item, turn in zip(items, turns)]
        require_clear(self.name, outlines, offsets, why, keys.gap)
        require_size(self.name, spec.size, 1.0 / tightest_ring_radius(outlines, offsets), why)
        return Draft(tuple(range(len(items))), offsets, np.zeros(len(items)), turns, heading)

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check roundness, gaps, the opening toward the heading, size, and that all stand on the table."""
        checks = [count_check(bodies, self.name, self.least)]
        if len(bodies) < self.least:
            return checks
        centre, radius, offsets = fit_ring(bodies)
        checks.append(roundness_check(offsets, radius))
        checks += _gap_checks(offsets, spec)
        directions = offsets / np.linalg.norm(offsets, axis=1, keepdims=True)
        tightest = tightest_ring_radius([body.local_footprint for body in bodies], directions)
        # Objects in a straight line lie on a circle of any size, all in one direction from its centre.
        checks += size_checks(radius / max(tightest, 1e-9), spec)
        checks.append(on_table_check(bodies))
        return checks + position_checks(bodies, centre, spec, table)

    def has_heading(self, bodies: Sequence[PlacedBody]) -> bool:
        """Return whether the ring is open: one that is closed faces nowhere."""
        if len(bodies) < self.least:
            return False
        return _opening_ratio(angular_gaps(fit_ring(bodies)[2])[1]) >= OPENING_RATIO[0]

    def neighbours(self, bodies: Sequence[PlacedBody], spec: StructureSpec) -> list[tuple[int, int]]:
        """Return each body and the next one round the ring; not the two at its opening, if it has to have one."""
        sequence = self.sequence(bodies)
        pairs = list(zip(sequence, sequence[1:]))
        return pairs if spec.rotation else [*pairs, (sequence[-1], sequence[0])]

    def corrections(self, bodies: Sequence[PlacedBody], size: str | None) -> np.ndarray:
        """Return how far (N, 2), metres, each body moves along its radius: into the size's band, and near the ring."""
        if len(bodies) < self.least:
            return super().corrections(bodies, size)
        _, radius, offsets = fit_ring(bodies)
        distances = np.linalg.norm(offsets, axis=1)
        directions = offsets / distances[:, None]
        tightest = tightest_ring_radius([body.local_footprint for body in bodies], directions)
        wanted = clip_to_size(radius, tightest, size)
        most = _KEPT * max_off_circle(wanted)
        return (wanted + np.clip(distances - radius, -most, most) - distances)[:, None] * directions


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
