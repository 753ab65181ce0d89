"""The line: objects side by side, across the heading that it faces, as a row of soldiers.

Object i takes place i, from the left of the heading to the right.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import (
    CLEARANCE,
    MAX_LENGTH_OFF,
    MAX_LINE_OFF_DEGREES,
    MAX_OFF_LINE,
    MIN_LINE_OBJECTS,
    max_uneven,
)
from structdiffusion.footprints import clear_gap, separation_along, turned
from structdiffusion.geometry import HEADING_OF_ROTATION
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.checks import Check, count_check, on_table_check, position_checks, size_checks
from structdiffusion.structures.gaps import KEPT, require_size
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.sequences import run_of
from structdiffusion.structures.sizes import clip_to_size, draw_size_ratio
from structdiffusion.structures.structure import Draft, LayoutError, Structure

_KEPT = 0.6  # of what the evaluation protocol lets rows be off and uneven: what is off by more is moved in
_ROUNDS = 8  # of evening out gaps


class Line(Structure):
    """Two or more objects in a row."""

    name = "line"
    least = MIN_LINE_OBJECTS
    usual_counts = (2, 6)
    rotations = ("north", "east")  # it faces both ways: north is south, and east is west
    often_one_noun = True
    demonstration_share = 0.22
    crowded_share = 0.35

    def draft(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys = NO_KEYS,
    ) -> Draft:
        """Draw a row with even clear gaps, in which long objects lie across the row.

        Raises:
            LayoutError: for fewer than two objects, or an order, a gap or a length that they cannot have.
        """
        self.require_enough(items)
        run = run_of(items, keys.order, heading, spec.rotation, keys.along, self.name, rng)
        heading, given = run.heading, items
        items = [given[i] for i in run.sequence]
        direction = np.array([math.sin(heading), -math.cos(heading)])  # to the right of the heading
        turns = np.array([item.turn_to_axis(heading) for item in items])
        outlines = [turned(item.footprint, turn) for item, turn in zip(items, turns)]
        tight = np.array([separation_along(a, b, direction) for a, b in zip(outlines, outlines[1:])])
        # Every gap grows by the same length, so that the clear gaps stay even.
        steps = tight + self._spread(tight, outlines, direction, spec, rng, keys)
        along = np.concatenate(([0.0], np.cumsum(steps)))
        along -= along[-1] / 2
        return Draft(run.sequence, along[:, None] * direction, np.zeros(len(items)), turns, heading)

    def _spread(
        self,
        tight: np.ndarray,
        outlines: Sequence[np.ndarray],
        direction: np.ndarray,
        spec: StructureSpec,
        rng: np.random.Generator,
        keys: StructureKeys,
    ) -> float | np.ndarray:
        """Return by how much, metres, the distances (N - 1,) of neighbours exceed the tightest ones.

        Raises:
            LayoutError: if the requested gap, length and size contradict one another.
        """
        if keys.gap is None and keys.length is None:
            return (draw_size_ratio(spec, rng) - 1) * tight.sum() / len(tight)
        if keys.gap is None:
            why, spread = f"a length of {keys.length:.3g} m", (keys.length - tight.sum()) / len(tight)
            if spread < 0:
                raise LayoutError(f"a line of these objects cannot have {why}: it is {tight.sum():.3f} m long or more")
        else:
            why = f"gaps of {keys.gap:.3g} m"
            wide = [separation_along(a, b, direction, keys.gap) for a, b in zip(outlines, outlines[1:])]
            spread = np.array(wide) - tight
            if keys.length is not None and abs(sum(wide) - keys.length) > KEPT * MAX_LENGTH_OFF:
                raise LayoutError(
                    f"a line of these objects with {why} is {sum(wide):.3f} m long, not {keys.length:.3g} m: "
                    "leave one of them open"
                )
        require_size(self.name, spec.size, float((tight + spread).sum() / tight.sum()), why)
        return spread

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check straightness, even gaps, the direction, size, and that all stand on the table."""
        checks = [count_check(bodies, self.name, self.least)]
        if len(bodies) < self.least:
            return checks
        direction, along, across = _axes(np.array([body.centroid for body in bodies]))
        worst = float(np.abs(across).max())
        checks.append(Check("distance to the line (m)", worst <= MAX_OFF_LINE, worst, f"<= {MAX_OFF_LINE:.3f}"))

        order = np.argsort(along)
        neighbours = [(bodies[i], bodies[j]) for i, j in zip(order, order[1:])]
        gaps = np.array([clear_gap(a.footprint, b.footprint) for a, b in neighbours])
        uneven, allowed = float(np.abs(gaps - gaps.mean()).max()), max_uneven(float(gaps.mean()))
        checks.append(Check("gap off the mean gap (m)", uneven <= allowed, uneven, f"<= {allowed:.3f}"))
        checks.append(on_table_check(bodies))
        if spec.rotation is not None:
            heading = HEADING_OF_ROTATION[spec.rotation]
            sine = abs(float(direction @ (math.cos(heading), math.sin(heading))))
            off, limit = math.degrees(math.asin(min(1.0, sine))), MAX_LINE_OFF_DEGREES
            checks.append(Check("line off perpendicular to its heading (deg)", off <= limit, off, f"<= {limit:g}"))
        tightest = sum(separation_along(a.local_footprint, b.local_footprint, direction) for a, b in neighbours)
        checks += size_checks(float(along.max() - along.min()) / tightest, spec)
        return checks + position_checks(bodies, self.centre(bodies), spec, table)

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the point (2,) halfway between the end objects."""
        points = np.array([body.centroid for body in bodies])
        direction = np.linalg.svd(points - points.mean(axis=0))[2][0]
        along = points @ direction
        return 0.5 * (points[along.argmin()] + points[along.argmax()])

    def sequence(self, bodies: Sequence[PlacedBody]) -> list[int]:
        """Return the bodies' indices along the line, from one end to the other."""
        return [int(i) for i in np.argsort(_axes(np.array([body.centroid for body in bodies]))[1])]

    def length(self, bodies: Sequence[PlacedBody]) -> float:
        """Return the distance, metres, along the line between the centroids at its ends."""
        return float(np.ptp(_axes(np.array([body.centroid for body in bodies]))[1]))

    def corrections(self, bodies: Sequence[PlacedBody], size: str | None) -> np.ndarray:
        """Return how far (N, 2), metres, each body moves along the line and across it.

        Where an object stands on another, none moves.
        """
        if len(bodies) < self.least or any(body.rests_on for body in bodies):
            return super().corrections(bodies, size)
        direction, along, across = _axes(np.array([body.centroid for body in bodies]))
        normal = np.array([-direction[1], direction[0]])
        order = np.argsort(along)
        outlines = [bodies[i].local_footprint for i in order]
        tight = np.array([separation_along(one, other, direction) for one, other in zip(outlines, outlines[1:])])
        spread = np.diff(along[order]) - tight  # beyond the tightest
        for _ in range(_ROUNDS):  # the mean changes with what is moved in
            most = _KEPT * max_uneven(spread.mean() + CLEARANCE)
            spread = spread.mean() + np.clip(spread - spread.mean(), -most, most)
        extent, tightest = float((tight + spread).sum()), float(tight.sum())
        # Every gap changes by the same length: clear gaps that were even stay even.
        spread += (clip_to_size(extent, tightest, size) - extent) / len(spread)
        new_along = np.concatenate(([0.0], np.cumsum(tight + spread)))
        new_along += 0.5 * (along[order[0]] + along[order[-1]] - new_along[-1])
        moves = np.empty((len(bodies), 2))
        moves[order] = (new_along - along[order])[:, None] * direction
        most = _KEPT * MAX_OFF_LINE
        return moves + (np.clip(across, -most, most) - across)[:, None] * normal


def _axes(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the direction (2,) of the least-squares line, and where points (N, 2) lie along and across it,
    (N,) each.
    """
    middle = points.mean(axis=0)
    direction = np.linalg.svd(points - middle)[2][0]
    return direction, (points - middle) @ direction, (points - middle) @ np.array([-direction[1], direction[0]])
