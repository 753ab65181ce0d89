"""The flat figure: objects that show a drawing or a pattern seen from above. It faces its reader, or points somewhere.

Object i takes place i of `structdiffusion.figures.strokes.places_of`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from grounding.figures.drawings import without_drawings
from grounding.figures.figure import Figure
from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import MAX_FIGURE_OFF_DEGREES, MAX_FIGURE_OFF_SHARE, MAX_GAP_VARIATION
from structdiffusion.figures.matching import Match, evened, matched
from structdiffusion.figures.strokes import Places, places_of, variation
from structdiffusion.footprints import clear_gap, tightest_scale, turned
from structdiffusion.geometry import HEADING_OF_ROTATION, wrap_angle
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.checks import (
    HEADING_MEASURE,
    Check,
    on_table_check,
    position_checks,
    size_checks,
)
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.sequences import DIRECTION_OF_START, sequence_by
from structdiffusion.structures.sizes import clip_to_size, draw_size_ratio
from structdiffusion.structures.spread import SpreadStructure, spread_ratio
from structdiffusion.structures.structure import Draft, LayoutError, a_structure

# Times the usual gap along a stroke: a wider one breaks it, and what is apart in the drawing has to be this far apart.
_BROKEN, _PARTED = 2.0, 1.35
_KEPT = 0.85  # of the limits of the evaluation protocol that layouts keep
_WIDER = 1.12  # factor by which an open size grows until the gaps are even
_MOST_WIDER = 6
_CROWDED = 1.5  # factor by which even gaps may make a figure wider
_ROUNDS = 3  # of evening out the gaps at a scale that follows from them


class FlatFigure(SpreadStructure):
    """A drawing or a pattern.

    Args:
        figure: that it shows.
    """

    def __init__(self, figure: Figure) -> None:
        self.figure, self.name, self.least = figure, figure.name, figure.legal[0]
        few = [count for count in figure.legal if count <= max(figure.legal[0], 12)]
        self.usual_counts = (few[0], few[-1])

    def draft(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys = NO_KEYS,
    ) -> Draft:
        """Draw the figure; without a rotation it can be read from the robot's side.

        Raises:
            LayoutError: for a number of objects that cannot show it, or widths that make its gaps uneven.
        """
        require_legal(self.figure, len(items))
        try:
            places = places_of(self.figure, len(items))
        except ValueError as error:  # a drawing of a person or a language model, with more junctions than `least` tells
            raise LayoutError(f"{len(items)} objects cannot show the strokes of {a_structure(self.name)}") from error
        turn = self._turn(spec)
        drawn = turned(places.points - places.points.mean(axis=0), turn)
        order = self._order(items, places, drawn, keys, rng)
        items = [items[i] for i in order]
        turns = np.array([item.turn_to_axis(axis + turn) for item, axis in zip(items, places.axes)])
        outlines = [turned(item.footprint, by) for item, by in zip(items, turns)]
        ratio = draw_size_ratio(spec, rng)
        tries = 1 if spec.size is not None else _MOST_WIDER
        offsets, uneven = drawn, math.inf
        for k in range(tries):
            found = self._spaced(places, drawn, places.axes + turn, outlines, ratio * _WIDER**k)
            if (varies := _uneven(places, outlines, found)) < uneven:
                offsets, uneven = found, varies
            if uneven <= _KEPT * MAX_GAP_VARIATION:
                break
        if uneven > _KEPT * MAX_GAP_VARIATION:
            raise LayoutError(
                f"objects of such different widths cannot stand evenly along {a_structure(self.name)}: their gaps "
                f"would vary by {uneven:.2f} of their mean; legal: {MAX_GAP_VARIATION}"
            )
        off = matched(places, offsets, turn).off
        if off > _KEPT * MAX_FIGURE_OFF_SHARE:
            raise LayoutError(
                f"these objects cannot show {a_structure(self.name)}: it would be {off:.2f} off the drawing"
            )
        return Draft(tuple(order), offsets - offsets.mean(axis=0), np.zeros(len(items)), turns, self._heading(turn))

    def _spaced(
        self, places: Places, drawn: np.ndarray, axes: np.ndarray, outlines: Sequence[np.ndarray], ratio: float
    ) -> np.ndarray:
        """Return the offsets (N, 2) at a ratio of the tightest scale, with gaps that are even."""
        scale = ratio * tightest_scale(outlines, drawn)
        now = drawn * scale
        for _ in range(_ROUNDS):
            now = evened(places, drawn * scale, axes, outlines)
            if (wider := ratio * tightest_scale(outlines, now)) > _CROWDED:
                return drawn * ratio * tightest_scale(outlines, drawn)  # even gaps would bring other objects together
            scale *= wider
        return now * ratio * tightest_scale(outlines, now)

    def _order(
        self,
        items: Sequence[LayoutItem],
        places: Places,
        drawn: np.ndarray,
        keys: StructureKeys,
        rng: np.random.Generator,
    ) -> list[int]:
        """Return which item stands on each place: in the requested order, or the widest where there is most room."""
        if keys.order is not None:
            sequence = list(sequence_by(items, keys.order, rng))
            (chain,) = places.chains
            along = list(dict.fromkeys(chain))
            if keys.order.start is not None:
                toward = DIRECTION_OF_START[keys.order.start]
                if float(drawn[along[0]] @ toward) < float(drawn[along[-1]] @ toward):
                    along.reverse()
            by_place = dict(zip(along, sequence, strict=True))
            return [by_place[place] for place in range(len(items))]
        distances = np.linalg.norm(drawn[:, None] - drawn, axis=-1) + np.diag(np.full(len(drawn), np.inf))
        room = np.round(distances.min(axis=1), 2)
        widths = [float(np.linalg.norm(item.footprint, axis=1).max()) for item in items]
        order = np.empty(len(items), int)
        order[np.lexsort((rng.random(len(items)), room))] = np.argsort(widths, kind="stable")
        return [int(i) for i in order]

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check outline, topology, spacing, heading, size, place, and that all objects stand on the table."""
        checks = [count_check(self.figure, len(bodies))]
        if not checks[0].passed:
            return checks
        places, match = self._match(bodies, spec)
        standing = [bodies[i] for i in match.order]
        limit = MAX_FIGURE_OFF_SHARE
        checks.append(
            Check("outline off the drawing (share of its width)", match.off <= limit, match.off, f"<= {limit:g}")
        )
        joined = _joined_otherwise(places, standing)
        checks.append(Check("ends, junctions and strokes that differ", joined == 0, joined, "0"))
        uneven = _uneven(places, [body.footprint for body in standing], None)
        checks.append(
            Check(
                "variation of the gaps along a stroke", uneven <= MAX_GAP_VARIATION, uneven, f"<= {MAX_GAP_VARIATION:g}"
            )
        )
        checks.append(on_table_check(bodies))
        if spec.rotation is not None:
            degrees = abs(math.degrees(wrap_angle(self._heading(match.heading) - HEADING_OF_ROTATION[spec.rotation])))
            limit = MAX_FIGURE_OFF_DEGREES
            checks.append(Check(f"{HEADING_MEASURE} (deg off)", degrees <= limit, degrees, f"<= {limit:g}"))
        if spec.size is not None:
            checks += size_checks(spread_ratio(bodies), spec)
        return checks + position_checks(bodies, self.centre(bodies), spec, table)

    def sequence(self, bodies: Sequence[PlacedBody]) -> list[int]:
        """Return the bodies' indices along the strokes, one stroke after another."""
        if len(bodies) not in self.figure.legal:
            return super().sequence(bodies)
        places, match = self._match(bodies, StructureSpec(self.name))
        along = list(dict.fromkeys(i for chain in places.chains for i in chain))
        along += [i for i in range(len(bodies)) if i not in along]
        return [int(match.order[i]) for i in along]

    def corrections(self, bodies: Sequence[PlacedBody], size: str | None) -> np.ndarray:
        """Return how far (N, 2), metres, each body moves from or to the centre, into the size's band."""
        if len(bodies) < 2 or size is None or any(body.rests_on for body in bodies):
            return np.zeros((len(bodies), 2))
        offsets = np.array([body.centroid for body in bodies]) - self.centre(bodies)
        ratio = spread_ratio(bodies)
        return (clip_to_size(ratio, 1.0, size) / ratio - 1.0) * offsets

    def _match(self, bodies: Sequence[PlacedBody], spec: StructureSpec) -> tuple[Places, Match]:
        places = places_of(self.figure, len(bodies))
        return places, matched(places, np.array([body.centroid for body in bodies]), self._turn(spec))

    def _turn(self, spec: StructureSpec) -> float:
        """Return by how much (rad) the drawing is turned, whose right is +x and whose top is +y."""
        if spec.rotation is None:
            return -math.pi / 2  # the top is away from the robot
        front = HEADING_OF_ROTATION[spec.rotation]
        return front - math.pi / 2 if self.figure.points else front + math.pi / 2

    def _heading(self, turn: float) -> float:
        """Return the heading (rad) of a drawing that is turned by so much: where it points, or where its reader is."""
        return turn + math.pi / 2 if self.figure.points else turn - math.pi / 2


def count_check(figure: Figure, count: int) -> Check:
    """Check that so many objects can show a figure."""
    return Check(
        f"objects in the {without_drawings(figure.name)}", count in figure.legal, count, figure.legal_numbers()
    )


def require_legal(figure: Figure, count: int) -> None:
    """Raise a `LayoutError` for a number of objects that cannot show a figure."""
    if count not in figure.legal:
        raise LayoutError(f"{a_structure(figure.name)} needs {figure.legal_numbers()} objects, got {count}")


def _gaps(places: Places, outlines: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return the clear gaps (m) along each stroke, of outlines in one frame by place."""
    return [np.array([clear_gap(outlines[i], outlines[j]) for i, j in pairwise(chain)]) for chain in places.chains]


def _uneven(places: Places, outlines: Sequence[np.ndarray], offsets: np.ndarray | None) -> float:
    """Return the largest variation of the clear gaps along a stroke."""
    there = outlines if offsets is None else [outline + at for outline, at in zip(outlines, offsets)]
    return max((variation(gaps) for gaps in _gaps(places, there)), default=0.0)


def _joined_otherwise(places: Places, standing: Sequence[PlacedBody]) -> int:
    """Count the pairs of objects that the drawing joins or parts, and that look otherwise.

    Two look joined if their gap is no wider than about a usual one along the strokes that they belong to.
    """
    outlines = [body.footprint for body in standing]
    usual: dict[int, float] = {}
    wrong = 0
    for chain, gaps in zip(places.chains, _gaps(places, outlines)):
        mean = max(float(gaps.mean()), 1e-3)
        wrong += int((gaps > _BROKEN * mean).sum())
        for i in chain:
            usual[i] = max(usual.get(i, 0.0), mean)
    for i, j in places.apart():
        if i in usual and j in usual:
            wrong += clear_gap(outlines[i], outlines[j]) < _PARTED * min(usual[i], usual[j])
    return wrong
