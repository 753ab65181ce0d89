"""The cross: two straight lines of objects at right angles, which share the object at their crossing. It faces nowhere.

Place 0 is the crossing; the places after it go outward, one on each of the four arms in turn, counter-clockwise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import (
    MAX_CROSS_OFF_DEGREES,
    MAX_OFF_CORNER,
    MAX_OFF_LINE,
    MIN_CROSS_OBJECTS,
)
from structdiffusion.footprints import separation_along, turned
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.checks import Check, count_check, on_table_check, position_checks, size_checks
from structdiffusion.structures.gaps import draft_with_gap
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.spread import SpreadStructure, draft_on_places, rotated, spread_ratio
from structdiffusion.structures.structure import Draft

_ARMS = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])


class Cross(SpreadStructure):
    """Five or more objects on two crossing lines."""

    name = "cross"
    least = MIN_CROSS_OBJECTS
    usual_counts = (5, 8)
    demonstration_share = 0.15
    crowded_share = 0.1

    def draft(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys = NO_KEYS,
    ) -> Draft:
        """Draw a cross along the table's edges, with even steps along its arms.

        Raises:
            LayoutError: for fewer than five objects, or a gap that they cannot have.
        """
        self.require_enough(items)
        heading = rng.integers(4) * math.pi / 2
        if keys.gap is not None:
            return self._with_gap(items, spec, heading, keys.gap)
        steps = [(k // 4 + 1) * _ARMS[k % 4] for k in range(len(items) - 1)]
        places = rotated(np.array([(0.0, 0.0), *steps]), heading)
        return draft_on_places(items, places, [heading] * len(items), spec, heading, rng)

    def _with_gap(self, items: Sequence[LayoutItem], spec: StructureSpec, heading: float, gap: float) -> Draft:
        """Draw a cross with one clear gap between neighbours."""
        turns = np.array([item.turn_to_axis(heading) for item in items])
        outlines = [turned(item.footprint, turn) for item, turn in zip(items, turns)]
        offsets, arms = np.zeros((len(items), 2)), rotated(_ARMS, heading)
        for place in range(1, len(items)):
            before = place - 4 if place > 4 else 0
            arm = arms[(place - 1) % 4]
            offsets[place] = offsets[before] + separation_along(outlines[before], outlines[place], arm, gap) * arm
        return draft_with_gap(self.name, spec, range(len(items)), outlines, offsets, turns, heading, gap)

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check both lines, their angle, the object at the crossing, the arms, size,
        and that all stand on the table.
        """
        checks = [count_check(bodies, self.name, self.least)]
        if len(bodies) < self.least:
            return checks
        found = fit_cross(np.array([body.centroid for body in bodies]))
        for name, passed, measured, limit in (
            ("distance to the lines (m)", found.off_line <= MAX_OFF_LINE, found.off_line, f"<= {MAX_OFF_LINE:.3f}"),
            (
                "lines off a right angle (deg)", found.off_right_angle <= MAX_CROSS_OFF_DEGREES, found.off_right_angle,
                f"<= {MAX_CROSS_OFF_DEGREES:g}",
            ),
            ("crossing to its object (m)", found.missed <= MAX_OFF_CORNER, found.missed, f"<= {MAX_OFF_CORNER:.3f}"),
            ("arms with an object", found.arms == 4, found.arms, "4"),
        ):  # fmt: skip
            checks.append(Check(name, passed, measured, limit))
        checks.append(on_table_check(bodies))
        if spec.size is not None:
            checks += size_checks(spread_ratio(bodies), spec)
        return checks + position_checks(bodies, found.crossing, spec, table)

    def exact_places(self, points: np.ndarray) -> np.ndarray:
        """Return centroids (N, 2) projected to two lines at right angles through their crossing."""
        fit = fit_cross(points)
        first, second = (points[[line[0], line[-1]]] for line in fit.lines)
        # The mean direction of both lines, the second turned by a quarter.
        ways = [(end - start) / max(float(np.linalg.norm(end - start)), 1e-9) for start, end in (first, second)]
        quarter = np.array([ways[1][1], -ways[1][0]])
        axis = ways[0] + (quarter if quarter @ ways[0] >= 0 else -quarter)
        axes = np.array([axis, [-axis[1], axis[0]]]) / max(float(np.linalg.norm(axis)), 1e-9)
        local = (points - fit.crossing) @ axes.T
        for own, line in enumerate(fit.lines):
            local[[i for i in line if i != fit.middle], 1 - own] = 0.0
        local[fit.middle] = 0.0
        return fit.crossing + local @ axes

    def neighbours(self, bodies: Sequence[PlacedBody], spec: StructureSpec) -> list[tuple[int, int]]:
        """Return each body and the next one along both lines, through the crossing."""
        fit = fit_cross(np.array([body.centroid for body in bodies]))
        return [pair for line in fit.lines for pair in zip(line, line[1:])]

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the crossing (2,) of the lines; of fewer than five objects, the mean."""
        if len(bodies) < self.least:
            return super().centre(bodies)
        return fit_cross(np.array([body.centroid for body in bodies])).crossing


@dataclass(frozen=True)
class CrossFit:
    """Two lines through points.

    Attributes:
        middle: the point at the crossing.
        lines: the points of each line, by index, from one end to the other; the one at the crossing is in both.
        crossing: (2,) where the lines meet, metres.
        off_line: the largest distance of a point to its line, metres.
        off_right_angle: degrees.
        missed: distance from the crossing to its point, metres.
        arms: how many of the four arms have a point.
    """

    middle: int
    lines: tuple[tuple[int, ...], tuple[int, ...]]
    crossing: np.ndarray
    off_line: float
    off_right_angle: float
    missed: float
    arms: int


def fit_cross(points: np.ndarray) -> CrossFit:
    """Fit two lines to points (N, 2), N >= 5, for every choice of the point at the crossing; return the best fit."""
    fits = []
    for middle in range(len(points)):
        offsets = points - points[middle]
        fits += [
            _crossing_at(points, middle, offsets, offsets[other]) for other in range(len(points)) if other != middle
        ]

    def failures(fit: CrossFit) -> tuple[int, float]:
        failed = (fit.off_line > MAX_OFF_LINE, fit.off_right_angle > MAX_CROSS_OFF_DEGREES, fit.missed > MAX_OFF_CORNER)
        return sum(failed) + (4 - fit.arms), fit.off_line + fit.missed

    return min(fits, key=failures)


def _crossing_at(points: np.ndarray, middle: int, offsets: np.ndarray, direction: np.ndarray) -> CrossFit:
    """Fit the lines where one point is at the crossing and one arm points in about this direction (2,)."""
    unit = direction / max(float(np.linalg.norm(direction)), 1e-9)
    along, across = offsets @ unit, offsets @ np.array([-unit[1], unit[0]])
    first = np.abs(along) >= np.abs(across)
    lines, directions, centres, off = [], [], [], 0.0
    for members, order in ((first, along), (~first, across)):
        chosen = [int(i) for i in np.argsort(order) if members[i] or i == middle]
        own = points[chosen]
        centre = own.mean(axis=0)
        axis = np.linalg.svd(own - centre)[2][0]
        off = max(off, float(np.abs((own - centre) @ np.array([-axis[1], axis[0]])).max()))
        lines.append(tuple(chosen))
        directions.append(axis)
        centres.append(centre)
    sine = abs(float(directions[0][0] * directions[1][1] - directions[0][1] * directions[1][0]))
    if sine < 1e-6 or min(map(len, lines)) < 2:
        return CrossFit(middle, (lines[0], lines[1]), points[middle], off, 90.0, np.inf, 0)
    steps = np.linalg.solve(np.column_stack((directions[0], -directions[1])), centres[1] - centres[0])
    crossing = centres[0] + steps[0] * directions[0]
    arms = sum(
        bool(any(sign * order[i] > 0 for i in line)) for line, order in zip(lines, (along, across)) for sign in (1, -1)
    )
    missed = float(np.linalg.norm(points[middle] - crossing))
    return CrossFit(middle, (lines[0], lines[1]), crossing, off, math.degrees(math.acos(min(1.0, sine))), missed, arms)
