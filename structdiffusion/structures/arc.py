"""The arc: objects along a part of a circle, whose open side is its heading.

Object i takes place i, counter-clockwise from one end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import (
    ARC_DEGREES,
    MAX_ARC_OFF_DEGREES,
    MAX_GAP_RATIO,
    MIN_ARC_OBJECTS,
)
from structdiffusion.footprints import fit_circle, tightest_scale, turned
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
from structdiffusion.structures.gaps import draft_with_gap, require_size, ring_angles
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.rings import RingStructure, angular_gaps, fit_ring, radius_with_room, roundness_check
from structdiffusion.structures.sequences import run_of
from structdiffusion.structures.spread import SpreadStructure, draft_on_places, outward_axes, spread_ratio
from structdiffusion.structures.structure import Draft, LayoutError

_DRAWN_DEGREES = (160.0, 205.0)  # what an arc spans: well inside `ARC_DEGREES`
_WIDEST_DEGREES, _SPAN_MARGIN = 230.0, 4.0  # with a requested radius or gap
_EVEN = 0.95  # of the largest gap ratio that the evaluation protocol allows, up to which layouts go


class Arc(RingStructure, SpreadStructure):
    """Three or more objects on an arc, about half a circle."""

    name = "arc"
    least = MIN_ARC_OBJECTS
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
        """Draw an arc in which long objects lie along the radius.

        Raises:
            LayoutError: for fewer than three objects, or an order, a gap or a radius that they cannot have.
        """
        self.require_enough(items)
        run = run_of(items, keys.order, heading, spec.rotation, None, self.name, rng)
        items, heading = [items[i] for i in run.sequence], run.heading
        span = math.radians(rng.uniform(*_DRAWN_DEGREES))
        if keys.gap is not None:
            draft = self._with_gap(items, spec, heading, span, keys)
        else:
            draft = self._even(items, spec, heading, span, rng, keys)
        return replace(draft, order=run.sequence)

    def _even(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        span: float,
        rng: np.random.Generator,
        keys: StructureKeys,
    ) -> Draft:
        """Draw an arc with even angles; with a requested radius, it spans as much as the objects need."""
        spans = [span] if keys.radius is None else np.linspace(span, math.radians(_WIDEST_DEGREES), 5)
        reason: LayoutError | None = None
        for wide in spans:
            angles = heading + math.pi + np.linspace(-wide / 2, wide / 2, len(items))
            places = np.column_stack((np.cos(angles), np.sin(angles)))
            draft = draft_on_places(items, places, outward_axes(places), spec, heading, rng)
            if keys.radius is None:
                return draft
            outlines = [turned(item.footprint, turn) for item, turn in zip(items, draft.turns)]
            tightest = tightest_scale(outlines, places)
            try:
                radius = radius_with_room(self.name, keys.radius, tightest)
                require_size(self.name, spec.size, radius / tightest, f"a radius of {radius:.3g} m")
                return replace(draft, offsets=radius * places)
            except LayoutError as error:
                reason = error
        assert reason is not None
        raise reason

    def _with_gap(
        self, items: Sequence[LayoutItem], spec: StructureSpec, heading: float, span: float, keys: StructureKeys
    ) -> Draft:
        """Draw an arc with one clear gap between neighbours."""
        assert keys.gap is not None
        angles, radius, turns = ring_angles(
            items, keys.gap,
            lambda steps: heading + math.pi - float(steps[:-1].sum()) / 2,
            lambda steps: span + float(steps[-1]), keys.radius,
        )  # fmt: skip
        why = f"gaps of {keys.gap:.3g} m" + (f" and a radius of {keys.radius:.3g} m" if keys.radius is not None else "")
        steps = np.diff(angles)
        spanned, (low, high) = math.degrees(steps.sum()), ARC_DEGREES
        if not low + _SPAN_MARGIN <= spanned <= high - _SPAN_MARGIN:
            raise LayoutError(
                f"an arc of these objects with {why} spans {spanned:.0f} degrees; legal: {low:g} to {high:g}"
            )
        if steps.max() > _EVEN * MAX_GAP_RATIO * steps.mean():
            raise LayoutError(f"objects of such different sizes cannot form an even arc with {why}")
        offsets = radius * np.column_stack((np.cos(angles), np.sin(angles)))
        outlines = [turned(item.footprint, turn) for item, turn in zip(items, turns)]
        return draft_with_gap(self.name, spec, range(len(items)), outlines, offsets, turns, heading, keys.gap, why)

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check roundness, span, inner gaps, the open side, size, and that all objects stand on the table."""
        checks = [count_check(bodies, self.name, self.least)]
        if len(bodies) < self.least:
            return checks
        centre, radius, offsets = fit_ring(bodies)
        checks.append(roundness_check(offsets, radius))
        angles, gaps = angular_gaps(offsets)
        largest = int(gaps.argmax())
        span, (low, high) = math.degrees(2 * math.pi - gaps[largest]), ARC_DEGREES
        checks.append(Check("span of the arc (deg)", low <= span <= high, span, f"{low:g} to {high:g}"))
        inner = np.delete(gaps, largest)
        ratio = float(inner.max() / max(inner.mean(), 1e-9))
        checks.append(
            Check("largest inner gap / mean inner gap", ratio <= MAX_GAP_RATIO, ratio, f"<= {MAX_GAP_RATIO:g}")
        )
        checks.append(on_table_check(bodies))
        if spec.rotation is not None:
            middle = float(angles[largest] + gaps[largest] / 2)
            name = f"open side's {HEADING_MEASURE} (deg off)"
            checks.append(heading_check(name, middle, spec.rotation, MAX_ARC_OFF_DEGREES))
        if spec.size is not None:
            checks += size_checks(spread_ratio(bodies), spec)
        return checks + position_checks(bodies, centre, spec, table)

    def exact_places(self, points: np.ndarray) -> np.ndarray:
        """Return places (N, 2) at even angles of the circle nearest to centroids (N, 2), of a span that is drawn."""
        centre, radius = fit_circle(points)
        offsets = points - centre
        angles, gaps = angular_gaps(offsets)
        largest = int(gaps.argmax())
        order = np.roll(np.argsort(np.arctan2(offsets[:, 1], offsets[:, 0])), -1 - largest)
        span = float(np.clip(2 * math.pi - gaps[largest], *np.radians(_DRAWN_DEGREES)))
        middle = float(angles[largest] + gaps[largest] / 2) + math.pi
        even = middle + np.linspace(-span / 2, span / 2, len(points))
        places = np.empty_like(points)
        places[order] = centre + radius * np.column_stack((np.cos(even), np.sin(even)))
        return places
