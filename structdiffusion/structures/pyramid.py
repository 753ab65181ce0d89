"""The pyramid: a standing wall of rows, each shorter by one than the row below. It faces nowhere.

Places go row by row from the bottom, and along the wall within a row.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
import shapely

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import MAX_OFF_LINE, MIN_PYRAMID_OBJECTS
from structdiffusion.footprints import separation_along, turned
from structdiffusion.geometry import wrap_angle
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, ObjectTraits, PlacedBody
from structdiffusion.structures.checks import Check, count_check, position_checks
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.structure import LIFT, STANDING, TALLEST, Draft, LayoutError, Structure, Traits
from structdiffusion.tableware import BASES, CUTLERY

_TALLEST_OBJECT = 0.16  # m, as in a tower
_SLENDER = 4.0  # height over radius of an object that falls when another is set down on its edge
_CLEAR = 0.004  # m between neighbours of a row: what they carry has to reach both
# Degrees by which an object may lean that lies on two of different heights: rows are as level as they can be, up to the
# last. Heights that were estimated from clouds are off by some millimetres.
_LEAN_DEGREES = (2.0, 4.0, 8.0)
# Gap between neighbours of the lowest row, over the breadth of the narrowest upper object. What an object carries
# presses on its inner half: over a narrow gap, one of the two below would carry everything.
_GAP_SHARE = 0.3
_WIDER = 0.06  # m by which gaps may be wider, for broad upper objects
_LEAST_HOLD = 0.15  # of the area of an object, that has to lie on each of the two that carry it


class Pyramid(Structure):
    """Three or more objects, in rows that become shorter by one."""

    name = "pyramid"
    least = MIN_PYRAMID_OBJECTS
    usual_counts = (3, 6)
    exact_count = False
    demonstration_share = 0.2  # more often than others, since some fall and are dropped
    requirement = (
        f"{STANDING}, lower than {_TALLEST_OBJECT} m, able to carry, not slender, and neither cutlery nor a plate or "
        "bowl"
    )
    stacks = True

    def suits(self, thing: ObjectTraits) -> bool:
        """Return whether an object stands, carries and is low; cutlery lies, and plates and bowls are narrow at their
        feet.
        """
        return super().suits(thing) and carries_in_walls(thing)

    def choose(self, candidates: Sequence[Traits], wanted: int, rng: np.random.Generator, named: bool) -> list[Traits]:
        """Choose objects whose heights make level rows: one, and those nearest to it in size.

        They share a noun if there are enough of one.

        Raises:
            LayoutError: if too few of them are alike.
        """
        wanted = max((count for count in range(self.least, wanted + 1) if row_lengths(count)), default=self.least)
        if len(candidates) < wanted:
            return super().choose(candidates, wanted, rng, named)
        nouns = Counter(one.category for one in candidates)
        first = next((one for one in candidates if nouns[one.category] >= wanted), candidates[0])
        some = [one for one in candidates if one.category == first.category or nouns[first.category] < wanted]
        return sorted(some, key=lambda one: abs(one.height - first.height) + abs(one.radius - first.radius))[:wanted]

    def draft(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys = NO_KEYS,
    ) -> Draft:
        """Draw a wall across its heading whose objects lie along it.

        Raises:
            LayoutError: for a number of objects that makes no such rows, or objects that cannot carry one another.
        """
        self.require_enough(items)
        heading = rng.integers(2) * math.pi / 2 if rng.random() < 0.5 else heading
        rows = _level_rows(items)
        direction = np.array([math.sin(heading), -math.cos(heading)])
        turns = np.array([flush_turn(item.footprint, heading - math.pi / 2) for item in items])
        outlines = [turned(item.footprint, turn) for item, turn in zip(items, turns)]
        order = [item for row in rows for item in row]
        offsets = _along_wall(rows, outlines, direction)[:, None] * direction
        _require_hold([outlines[i] + at for i, at in zip(order, offsets)], rows, items)
        heights, bottoms = [0.0] * len(rows[0]), []
        for row in rows:
            bottoms += heights[: len(row)]
            tops = [bottom + items[i].height + LIFT for bottom, i in zip(heights, row)]
            heights = [max(pair) for pair in zip(tops, tops[1:])]
        if max(bottoms) > TALLEST:
            raise LayoutError(
                f"a pyramid of these objects would be built up to {max(bottoms):.2f} m, and the arm reaches {TALLEST} m"
            )
        return Draft(tuple(order), offsets, np.array(bottoms), turns[order], heading)

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check the rows, what carries each object above the lowest row, and that the wall is straight."""
        checks = [count_check(bodies, self.name, self.least)]
        if len(bodies) < self.least:
            return checks
        rows = _rows_of(bodies)
        lengths = [len(row) for row in rows]
        shorter = sum(upper == lower - 1 for lower, upper in zip(lengths, lengths[1:]))
        narrows = shorter == len(rows) - 1 >= 1
        checks.append(Check("rows shorter by one than the row below", narrows, shorter, f"{max(len(rows) - 1, 1)}"))
        held = sum(
            len(bodies[i].rests_on) == 2 and set(bodies[i].rests_on) <= set(below)
            for below, row in zip(rows, rows[1:])
            for i in row
        )
        upper_count = len(bodies) - lengths[0]
        checks.append(
            Check("objects that rest on exactly two of the row below", held == upper_count, held, f"{upper_count}")
        )
        points = np.array([body.centroid for body in bodies])
        own = points[rows[0]]
        middle = own.mean(axis=0)
        direction = np.linalg.svd(own - middle)[2][0]
        worst = float(np.abs((points - middle) @ np.array([-direction[1], direction[0]])).max())
        checks.append(Check("distance to the wall's line (m)", worst <= MAX_OFF_LINE, worst, f"<= {MAX_OFF_LINE:.3f}"))
        return checks + position_checks(bodies, self.centre(bodies), spec, table)

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the mean (2,) of the lowest row."""
        return np.array([bodies[i].centroid for i in _rows_of(bodies)[0]]).mean(axis=0)

    def has_heading(self, bodies: Sequence[PlacedBody]) -> bool:
        """Return that it faces nowhere."""
        return False

    def order_places(
        self, items: Sequence[LayoutItem], random: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray | None:
        """Order objects (K, N) row by row from the bottom, in rows of about one height; unchanged if there are no such
        rows.
        """
        try:
            order = [item for row in _level_rows(items) for item in row]
        except LayoutError:
            return None
        return np.tile(order, (len(random), 1))


def carries_in_walls(thing: ObjectTraits) -> bool:
    """Return whether an object can be part of a wall that objects are released onto."""
    return (
        thing.stackable
        and thing.height < min(_TALLEST_OBJECT, _SLENDER * thing.radius)
        and thing.category not in (*CUTLERY, *BASES)
    )


def row_lengths(count: int) -> tuple[int, ...]:
    """Return the lengths of two or more rows, each shorter by one, of so many objects, the highest wall first; () for
    none.
    """
    for base in range(count):
        lengths, left = [], count
        for length in range(base, 0, -1):
            if left < length:
                break
            lengths.append(length)
            left -= length
        if left == 0 and len(lengths) > 1:
            return tuple(lengths)
    return ()


def _level_rows(items: Sequence[LayoutItem]) -> list[list[int]]:
    """Divide objects into rows, from the bottom, such that each row that carries another is level.

    Raises:
        LayoutError: if they cannot be divided so.
    """
    lengths = row_lengths(len(items))
    if not lengths:
        legal = [count for count in range(3, 16) if row_lengths(count)]
        raise LayoutError(
            f"{len(items)} objects do not make a pyramid, in which each row is one shorter; "
            f"numbers that do: {', '.join(map(str, legal))}"
        )
    if not all(item.flat_bottom for item in items):
        raise LayoutError("a pyramid needs objects with a level bottom")
    by_height = sorted(range(len(items)), key=lambda i: items[i].height)
    tried = (_rows_from(items, by_height, lengths, math.tan(math.radians(lean))) for lean in _LEAN_DEGREES)
    rows = next((found for found in tried if found is not None), None)
    if rows is None:
        heights = ", ".join(f"{item.category} {item.height:.3f} m" for item in items)
        raise LayoutError(
            f"a pyramid needs rows of objects that carry others and are equally high within "
            f"{_LEAN_DEGREES[-1]:g} degrees of lean; "
            f"these are not: {heights}"
        )
    return rows


def _rows_from(
    items: Sequence[LayoutItem], left: list[int], lengths: Sequence[int], lean: float
) -> list[list[int]] | None:
    """Return rows of these lengths from the remaining objects, sorted by height; `None` if there are none.

    `lean` is by how much the heights of a row's objects may differ, over the breadth of the narrowest.
    """
    if len(lengths) == 1:
        return [left]  # nothing stands on the highest row
    carriers = [i for i in left if items[i].stackable]
    starts = range(len(carriers) - lengths[0] + 1)
    # The broadest row lowest.
    for start in sorted(starts, key=lambda s: -sum(np.ptp(items[i].footprint) for i in carriers[s : s + lengths[0]])):
        row = carriers[start : start + lengths[0]]
        if items[row[-1]].height - items[row[0]].height <= lean * _narrowest(items, row):
            above = _rows_from(items, [i for i in left if i not in row], lengths[1:], lean)
            if above is not None:
                return [row, *above]
    return None


def _along_wall(rows: Sequence[Sequence[int]], outlines: Sequence[np.ndarray], direction: np.ndarray) -> np.ndarray:
    """Return where objects stand along a wall, (N,) by place, metres, about the middle of the lowest row.

    Each upper object stands over the middle of the gap between the two that carry it, so that both do, however broad
    they are. The gaps of the lowest row are as narrow as the balance and the breadth of the upper objects allow.
    """
    low = [float((outline @ direction).min()) for outline in outlines]
    high = [float((outline @ direction).max()) for outline in outlines]
    narrowest = min(high[i] - low[i] for row in rows[1:] for i in row)
    first = max(_CLEAR, _GAP_SHARE * narrowest)
    for gap in np.arange(first, first + _WIDER, _CLEAR):
        base = rows[0]
        steps = [separation_along(outlines[a], outlines[b], direction, gap) for a, b in zip(base, base[1:])]
        along = [np.concatenate(([0.0], np.cumsum(steps)))]
        for below, row in zip(rows, rows[1:]):
            under = along[-1]
            middles = [
                (under[k] + high[a] + under[k + 1] + low[b]) / 2 for k, (a, b) in enumerate(zip(below, below[1:]))
            ]
            along.append(np.array([middle - (low[i] + high[i]) / 2 for middle, i in zip(middles, row)]))
        apart = (
            after - before >= separation_along(outlines[a], outlines[b], direction, _CLEAR) - 1e-9
            for row, places in zip(rows[1:], along[1:])
            for a, b, before, after in zip(row, row[1:], places, places[1:])
        )
        if all(apart):
            break
    else:
        raise LayoutError("the upper objects of a pyramid are too wide to stand side by side on those below")
    return np.concatenate(along) - along[0].mean()


def _narrowest(items: Sequence[LayoutItem], row: Sequence[int]) -> float:
    """Return the breadth (m) of the narrowest object of a row."""
    return min(float(np.ptp(items[i].footprint, axis=0).min()) for i in row)


def flush_turn(footprint: np.ndarray, axis: float) -> float:
    """Return the turn (rad), the short way round, that brings the long side of an outline's tightest box to an axis."""
    edges = np.roll(footprint, -1, axis=0) - footprint
    angles = np.arctan2(edges[:, 1], edges[:, 0])
    sizes = np.array([np.ptp(turned(footprint, -angle), axis=0) for angle in angles])
    best = int(np.round(sizes.prod(axis=1), 6).argmin())
    long = angles[best] + (0.0 if sizes[best, 0] >= sizes[best, 1] else math.pi / 2)
    turn = float(wrap_angle(axis - long))
    return turn - math.copysign(math.pi, turn) if abs(turn) > math.pi / 2 else turn


def _require_hold(placed: Sequence[np.ndarray], rows: Sequence[Sequence[int]], items: Sequence[LayoutItem]) -> None:
    """Raise a `LayoutError` where an object does not lie far enough on both that carry it; outlines are by place."""
    start = 0
    for below, row in zip(rows, rows[1:]):
        for number in range(len(row)):
            upper = shapely.Polygon(placed[start + len(below) + number])
            for lower in (start + number, start + number + 1):
                if upper.intersection(shapely.Polygon(placed[lower])).area < _LEAST_HOLD * upper.area:
                    raise LayoutError(
                        f"the {items[row[number]].category} is too small to lie on two others of a pyramid"
                    )
        start += len(below)


def _rows_of(bodies: Sequence[PlacedBody]) -> list[list[int]]:
    """Return the bodies row by row from the bottom, by what carries them."""
    level: dict[int, int] = {}
    for i in sorted(range(len(bodies)), key=lambda i: bodies[i].z_bottom):
        level[i] = 1 + max((level.get(j, 0) for j in bodies[i].rests_on), default=-1)
    highest = max(level.values(), default=0)
    return [[i for i in range(len(bodies)) if level[i] == number] for number in range(highest + 1)]
