"""The cluster: objects gathered in the plane, each near another. It faces nowhere.

Any object may take any place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import (
    CLEARANCE,
    MAX_CLUSTER_GAP,
    MAX_CLUSTER_HULL_RATIO,
    MIN_CLUSTER_OBJECTS,
)
from structdiffusion.footprints import clear_gap, separations_along, tightest_scale, turned
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.checks import Check, count_check, on_table_check, position_checks, size_checks
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.sizes import clip_to_size
from structdiffusion.structures.spread import SpreadStructure, spread_ratio
from structdiffusion.structures.structure import Draft, LayoutError

_DIRECTIONS = 14  # from which an object is pushed to those that are there
_MARGIN = 0.9  # of the limits of the evaluation protocol that layouts keep
# Extent over tightest extent, the widest first, that are tried for each size: a wide cluster may fall apart.
_RATIOS = {
    "small": (1.15, 1.05, 1.01), "medium": (1.55, 1.45, 1.36), "large": (2.05, 1.95, 1.9), None: (1.2, 1.1, 1.02)
}  # fmt: skip


class Cluster(SpreadStructure):
    """Two or more objects close together."""

    name = "cluster"
    least = MIN_CLUSTER_OBJECTS
    usual_counts = (2, 7)
    demonstration_share = 0.15
    crowded_share = 0.1
    sizes = ("small",)  # in a medium cluster, nothing joins objects that are wider than 7 cm: its gaps are over 4 cm

    def draft(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys = NO_KEYS,
    ) -> Draft:
        """Draw a cluster: each object, the broadest first, is placed so that the hull of all stays smallest.

        Raises:
            LayoutError: for fewer than two objects, or where a cluster of this size would fall apart.
        """
        self.require_enough(items)
        turns = np.array([item.turn_to_axis(heading) for item in items])
        outlines = [turned(item.footprint, turn) for item, turn in zip(items, turns)]
        places = _packed(outlines, rng)
        places -= places.mean(axis=0)
        tightest = tightest_scale(outlines, places)
        for ratio in _RATIOS[spec.size]:
            offsets = ratio * tightest * places
            gap, hull = _joining_gap(outlines, offsets), _hull_ratio(outlines, offsets)
            if gap <= _MARGIN * MAX_CLUSTER_GAP and hull <= _MARGIN * MAX_CLUSTER_HULL_RATIO:
                return Draft(tuple(range(len(items))), offsets, np.zeros(len(items)), turns, heading)
        raise LayoutError(
            f"a {spec.size + ' ' if spec.size else ''}cluster of these objects would fall apart: its gaps would be "
            f"{gap:.3f} m wide and its hull {hull:.1f} times the objects' area; legal: {MAX_CLUSTER_GAP} m and "
            f"{MAX_CLUSTER_HULL_RATIO}"
        )

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check that the gaps that join the objects are narrow, the hull is tight, size, and that all stand on the
        table.
        """
        checks = [count_check(bodies, self.name, self.least)]
        if len(bodies) < self.least:
            return checks
        outlines, nowhere = [body.footprint for body in bodies], np.zeros((len(bodies), 2))
        gap, hull = _joining_gap(outlines, nowhere), _hull_ratio(outlines, nowhere)
        checks.append(
            Check("widest gap that joins the cluster (m)", gap <= MAX_CLUSTER_GAP, gap, f"<= {MAX_CLUSTER_GAP:.3f}")
        )
        limit = MAX_CLUSTER_HULL_RATIO
        checks.append(Check("hull / area of the objects", hull <= limit, hull, f"<= {limit:g}"))
        checks.append(on_table_check(bodies))
        if spec.size is not None:
            checks += size_checks(spread_ratio(bodies), spec)
        return checks + position_checks(bodies, self.centre(bodies), spec, table)

    def corrections(self, bodies: Sequence[PlacedBody], size: str | None) -> np.ndarray:
        """Return how far (N, 2), metres, each body moves: together if they lie apart, and into the size's band.

        Where an object stands on another, or nothing is wrong, none moves.
        """
        outlines, points = [body.local_footprint for body in bodies], np.array([body.centroid for body in bodies])
        if len(bodies) < self.least or any(body.rests_on for body in bodies):
            return np.zeros((len(bodies), 2))
        gap, hull = _joining_gap(outlines, points), _hull_ratio(outlines, points)
        apart = gap > _MARGIN * MAX_CLUSTER_GAP or hull > _MARGIN * MAX_CLUSTER_HULL_RATIO
        if not apart and (size is None or clip_to_size(spread_ratio(bodies), 1.0, size) == spread_ratio(bodies)):
            return np.zeros((len(bodies), 2))
        together = _drawn_together(outlines, points)
        middle = together.mean(axis=0)
        factor = clip_to_size(1.0, tightest_scale(outlines, together - middle), size)
        return points.mean(axis=0) + factor * (together - middle) - points


def _drawn_together(outlines: Sequence[np.ndarray], points: np.ndarray) -> np.ndarray:
    """Return places (N, 2) of outlines, each about its own origin, pushed to the middle one from where they are."""
    offsets = points - points.mean(axis=0)
    first, *others = np.argsort(np.linalg.norm(offsets, axis=1))
    places, placed = np.array(points), [first]
    for index in others:
        centre = places[placed].mean(axis=0)
        way = points[index] - centre
        direction = way / max(float(np.linalg.norm(way)), 1e-9)
        places[index] = _pushed(outlines, places, placed, index, centre, direction[None])[0]
        placed.append(index)
    return places


def _packed(outlines: Sequence[np.ndarray], rng: np.random.Generator) -> np.ndarray:
    """Return places (N, 2) of outlines, metres, each about its own origin, packed with the usual clearance."""
    places = np.zeros((len(outlines), 2))
    areas = [shapely.Polygon(outline).area * math.exp(0.1 * rng.standard_normal()) for outline in outlines]
    first, *others = np.argsort(areas)[::-1]
    placed = [first]
    start = rng.uniform(0, 2 * math.pi)
    angles = start + np.arange(_DIRECTIONS) * 2 * math.pi / _DIRECTIONS
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    for index in others:
        there = np.concatenate([outlines[k] + places[k] for k in placed])
        centre = places[placed].mean(axis=0)
        options = _pushed(outlines, places, placed, index, centre, directions)
        moved = outlines[index] + options[:, None]
        together = np.concatenate((np.broadcast_to(there, (len(moved), *there.shape)), moved), axis=1)
        hulls = shapely.convex_hull(shapely.linestrings(together))  # lines are made faster than sets of points
        places[index] = options[int(np.argmin(shapely.area(hulls)))]
        placed.append(index)
    return places


def _pushed(
    outlines: Sequence[np.ndarray],
    places: np.ndarray,
    placed: Sequence[int],
    index: int,
    centre: np.ndarray,
    directions: np.ndarray,
) -> np.ndarray:
    """Return where (D, 2) an outline comes to rest that is pushed toward a centre against each direction (D, 2)."""
    distances = np.zeros(len(directions))
    for other in placed:
        # The ray starts at the centre: the other outline is moved to where it lies as seen from there.
        at = outlines[other] + places[other] - centre
        distances = np.maximum(distances, separations_along(at, outlines[index], directions, CLEARANCE))
    return centre + distances[:, None] * directions


def _joining_gap(outlines: Sequence[np.ndarray], offsets: np.ndarray) -> float:
    """Return the widest clear gap (m) in the tree of narrowest gaps that joins all outlines."""
    placed = [outline + offset for outline, offset in zip(outlines, offsets)]
    nearest = np.array([clear_gap(placed[0], other) for other in placed])
    joined, widest = {0}, 0.0
    while len(joined) < len(placed):
        free = [i for i in range(len(placed)) if i not in joined]
        next_one = min(free, key=nearest.__getitem__)
        widest = max(widest, float(nearest[next_one]))
        joined.add(next_one)
        nearest = np.minimum(nearest, [clear_gap(placed[next_one], other) for other in placed])
    return widest


def _hull_ratio(outlines: Sequence[np.ndarray], offsets: np.ndarray) -> float:
    """Return the area of the convex hull of all outlines over the sum of their own areas."""
    points = np.concatenate([outline + offset for outline, offset in zip(outlines, offsets)])
    area = sum(shapely.Polygon(outline).area for outline in outlines)
    return float(shapely.MultiPoint(points).convex_hull.area / max(area, 1e-9))
