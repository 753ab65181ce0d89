"""The exact copy: objects in the very places of an example, levels and turns included.

Place i is `figure.places[i]`. Where the copy stands as a whole is open; it faces as the example does unless a rotation
is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grounding.figures.figure import Figure
from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import (
    MAX_COPY_OFF,
    MAX_COPY_TURN_DEGREES,
    MAX_FIGURE_OFF_DEGREES,
    MAX_PENETRATION,
)
from structdiffusion.figures.exact import Fit, alike, box_of, carriers_of, fit, turn_to
from structdiffusion.footprints import overlap_depths, turned
from structdiffusion.geometry import HEADING_OF_ROTATION, wrap_angle
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.checks import HEADING_MEASURE, Check, position_checks
from structdiffusion.structures.flat_figure import count_check, require_legal
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.structure import (
    LIFT,
    TALLEST,
    Draft,
    LayoutError,
    Structure,
    Traits,
    a_structure,
)

_KEPT = 0.8  # of the limits of the evaluation protocol that layouts keep
OFF = "farthest from its place in the example (m)"


class ExactCopy(Structure):
    """Objects in the places of an example.

    Args:
        figure: one with `places`.
    """

    exact_count = True
    exact = True

    def __init__(self, figure: Figure) -> None:
        self.figure, self.name, self.least = figure, figure.name, len(figure.places)
        self.stacks = figure.stacked
        self.usual_counts = (self.least, self.least)

    def choose(self, candidates: Sequence[Traits], wanted: int, rng: np.random.Generator, named: bool) -> list[Traits]:
        """Choose for each place the object that is most like the example's.

        Raises:
            LayoutError: if there are too few.
        """
        if len(candidates) < self.least:
            raise LayoutError(
                f"{a_structure(self.name)} needs {self.least} objects, but only {len(candidates)} can be used"
            )
        left, chosen = list(candidates), list[Traits]()
        for place in self.figure.places:
            length, width, height = place.size
            across = length / 2 if place.turn is None else math.hypot(length, width) / 2
            nearest = min(left, key=lambda one: abs(one.radius - across) + abs(one.height - height))
            left = [one for one in left if one is not nearest]
            chosen.append(nearest)
        return chosen

    def draft(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys = NO_KEYS,
    ) -> Draft:
        """Put the objects in the places of the example; like objects take like places.

        Raises:
            LayoutError: for another number of objects, or objects that do not fit there.
        """
        from scipy.optimize import linear_sum_assignment

        require_legal(self.figure, len(items))
        places = self.figure.places
        boxes = [box_of(item.footprint) for item in items]
        unlike = alike(np.array([(*box[:2], item.height) for box, item in zip(boxes, items)]), places)
        order = [int(i) for i in linear_sum_assignment(unlike**2)[1]]
        turn = _turn(spec)
        turns = np.array([turn_to(place, boxes[i], turn) for place, i in zip(places, order)])
        offsets = turned(np.array([(place.x, place.y) for place in places]), turn)
        heights = self._heights([items[i] for i in order])
        self._require_room([items[i] for i in order], offsets, heights, turns)
        return Draft(tuple(order), offsets - offsets.mean(axis=0), heights, turns, wrap_angle(turn - math.pi / 2))

    def _heights(self, items: Sequence[LayoutItem]) -> np.ndarray:
        """Return z (N,) of the bottoms of items in their places.

        Raises:
            LayoutError: where their heights bring one off its place, or one on what cannot carry it.
        """
        places, carriers = self.figure.places, carriers_of(self.figure.places)
        heights = np.zeros(len(places))
        for k in sorted(range(len(places)), key=lambda k: places[k].z):
            for j in carriers[k]:
                if not items[j].stackable:
                    raise LayoutError(
                        f"nothing can stand on the {items[j].category} that has to carry the {items[k].category}"
                    )
            heights[k] = max((heights[j] + items[j].height + LIFT for j in carriers[k]), default=0.0)
            off = heights[k] - LIFT * bool(carriers[k]) - places[k].z
            if abs(off) > _KEPT * MAX_COPY_OFF:
                raise LayoutError(
                    f"these objects do not fit the example: what the {items[k].category} stands on would be "
                    f"{abs(off) * 1000:.0f} mm {'higher' if off > 0 else 'lower'} than in the example; legal: "
                    f"{_KEPT * MAX_COPY_OFF * 1000:g} mm"
                )
            if heights[k] > TALLEST:
                raise LayoutError(f"the copy would be built up to {heights[k]:.2f} m, and the arm reaches {TALLEST} m")
        return heights

    def _require_room(
        self, items: Sequence[LayoutItem], offsets: np.ndarray, heights: np.ndarray, turns: np.ndarray
    ) -> None:
        """Raise a `LayoutError` where two items would be in one place."""
        outlines = [turned(item.footprint, turn) + at for item, turn, at in zip(items, turns, offsets)]
        tops = [bottom + item.height for bottom, item in zip(heights, items)]
        for k in range(len(items)):
            for j in range(k):
                beside = min(tops[j], tops[k]) - max(heights[j], heights[k]) > MAX_PENETRATION
                depth = float(overlap_depths(outlines[k][None], outlines[j][None])[0]) if beside else 0.0
                if depth > MAX_PENETRATION:
                    raise LayoutError(
                        f"these objects do not fit the example: the {items[j].category} and the {items[k].category} "
                        f"beside it would overlap by {depth * 1000:.0f} mm"
                    )

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check how far objects are from their places, how they are turned, heading and place."""
        checks = [count_check(self.figure, len(bodies))]
        if not checks[0].passed:
            return checks
        found = self.fit(bodies, spec)
        off, degrees = float(found.off.max()), math.degrees(float(found.turned.max()))
        checks.append(Check(OFF, off <= MAX_COPY_OFF, off, f"<= {MAX_COPY_OFF:g}"))
        limit = MAX_COPY_TURN_DEGREES
        checks.append(Check("most turned from its place (deg)", degrees <= limit, degrees, f"<= {limit:g}"))
        if spec.rotation is not None:
            degrees = abs(math.degrees(wrap_angle(found.heading - _turn(spec))))
            limit = MAX_FIGURE_OFF_DEGREES
            checks.append(Check(f"{HEADING_MEASURE} (deg off)", degrees <= limit, degrees, f"<= {limit:g}"))
        return checks + position_checks(bodies, self.centre(bodies), spec, table)

    def fit(self, bodies: Sequence[PlacedBody], spec: StructureSpec) -> Fit:
        """Lay the copy over the example: as many bodies as places."""
        return fit(
            np.array([body.centroid for body in bodies]),
            np.array([body.z_bottom for body in bodies]),
            [box_of(body.footprint) for body in bodies],
            np.array([body.z_top - body.z_bottom for body in bodies]),
            self.figure.places,
            None if spec.rotation is None else _turn(spec),
        )

    def sequence(self, bodies: Sequence[PlacedBody]) -> list[int]:
        """Return the bodies' indices from the bottom."""
        return sorted(range(len(bodies)), key=lambda i: bodies[i].z_bottom)


def _turn(spec: StructureSpec) -> float:
    """Return by how much (rad) the example is turned, whose right is +x and whose top is +y."""
    return HEADING_OF_ROTATION[spec.rotation] + math.pi / 2 if spec.rotation else -math.pi / 2
