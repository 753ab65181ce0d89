"""The grid: rows and columns at right angles. Rows run left to right; only the last, nearest row may be short.

Object i takes place i, row by row from the far left. A grid faces nowhere.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import MAX_OFF_LATTICE, MAX_UNEVEN_PITCH, MIN_GRID_OBJECTS
from structdiffusion.footprints import separation_along, turned
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.checks import Check, count_check, on_table_check, position_checks, size_checks
from structdiffusion.structures.gaps import best_order, draft_with_gap, separations
from structdiffusion.structures.keys import NO_KEYS, StructureKeys
from structdiffusion.structures.lattice import divisions, fit_lattice
from structdiffusion.structures.spread import SpreadStructure, draft_on_places, spread_ratio
from structdiffusion.structures.structure import Draft, LayoutError

_OBLONG = 0.4  # how much one more column than rows counts against a grid, compared with an empty place


class Grid(SpreadStructure):
    """Four or more objects in rows and columns."""

    name = "grid"
    least = MIN_GRID_OBJECTS
    usual_counts = (4, 9)
    demonstration_share = 0.17
    crowded_share = 0.15

    def draft(
        self,
        items: Sequence[LayoutItem],
        spec: StructureSpec,
        heading: float,
        rng: np.random.Generator,
        keys: StructureKeys = NO_KEYS,
    ) -> Draft:
        """Draw a grid along the table's edges, in which long objects lie across the rows.

        Raises:
            LayoutError: for fewer than four objects, a number of them that makes no such rows and columns, or a gap
                that they cannot have.
        """
        self.require_enough(items)
        rows, columns = rows_and_columns(len(items), keys.rows, keys.columns)
        outlines = [turned(item.footprint, item.turn_to_axis(0.0)) for item in items]
        numbers = np.array([divmod(k, columns) for k in range(len(items))])
        if keys.gap is not None:
            return self._with_gap(items, outlines, numbers, spec, rng, keys.gap)
        steps = [_least_step(outlines, numbers, axis) for axis in (0, 1)]
        # From the far left: -x from row to row, -y from column to column.
        places = -(numbers - ((rows - 1) / 2, (columns - 1) / 2)) * steps
        return draft_on_places(items, places, [0.0] * len(items), spec, 0.0, rng)

    def _with_gap(
        self,
        items: Sequence[LayoutItem],
        outlines: Sequence[np.ndarray],
        numbers: np.ndarray,
        spec: StructureSpec,
        rng: np.random.Generator,
        gap: float,
    ) -> Draft:
        """Draw a grid with one clear gap between neighbours, as far as even pitches allow."""
        axes = [separations(outlines, -np.eye(2)[axis], gap) for axis in (0, 1)]
        pairs = _neighbours_of(numbers)

        def needs(order: Sequence[int]) -> list[np.ndarray]:
            return [np.array([axes[axis][order[i], order[j]] for i, j in pairs[axis]]) for axis in (0, 1)]

        def middle(needed: np.ndarray) -> float:
            return float(needed.min() + needed.max()) / 2

        order = best_order(
            len(items), lambda order: max(float(np.ptp(needed)) / 2 for needed in needs(order)), gap, self.name, rng
        )
        steps = [middle(needed) for needed in needs(order)]
        offsets, own = -(numbers - numbers.max(axis=0) / 2) * steps, [outlines[i] for i in order]
        turns = np.array([items[i].turn_to_axis(0.0) for i in order])
        return draft_with_gap(self.name, spec, order, own, offsets, turns, 0.0, gap)

    def check(self, bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
        """Check that all stand on a lattice of even pitches, size, and that all stand on the table."""
        checks = [count_check(bodies, self.name, self.least)]
        if len(bodies) < self.least:
            return checks
        fit = fit_lattice(np.array([body.centroid for body in bodies]))
        checks.append(
            Check("distance to the lattice (m)", fit.off <= MAX_OFF_LATTICE, fit.off, f"<= {MAX_OFF_LATTICE:.3f}")
        )
        limit = MAX_UNEVEN_PITCH
        checks.append(Check("difference of pitches (m)", fit.uneven <= limit, fit.uneven, f"<= {limit:.3f}"))
        checks.append(on_table_check(bodies))
        if spec.size is not None:
            checks += size_checks(spread_ratio(bodies), spec)
        return checks + position_checks(bodies, fit.centre, spec, table)

    def exact_places(self, points: np.ndarray) -> np.ndarray:
        """Return the places (N, 2) of the lattice nearest to centroids (N, 2)."""
        return fit_lattice(points).exact

    def neighbours(self, bodies: Sequence[PlacedBody], spec: StructureSpec) -> list[tuple[int, int]]:
        """Return the pairs of bodies beside each other in a row or a column."""
        across, along = _neighbours_of(fit_lattice(np.array([body.centroid for body in bodies])).places)
        return across + along

    def rows_and_columns(self, bodies: Sequence[PlacedBody]) -> tuple[int, int]:
        """Return how many rows and columns it has; (0, 0) for fewer than four objects."""
        if len(bodies) < self.least:
            return 0, 0
        fit = fit_lattice(np.array([body.centroid for body in bodies]))
        return fit.rows, fit.columns

    def centre(self, bodies: Sequence[PlacedBody]) -> np.ndarray:
        """Return the middle (2,) of all places; of fewer than four objects, the mean."""
        if len(bodies) < self.least:
            return super().centre(bodies)
        return fit_lattice(np.array([body.centroid for body in bodies])).centre


def rows_and_columns(count: int, rows: int | None = None, columns: int | None = None) -> tuple[int, int]:
    """Return the numbers of rows and columns of a grid of a number of objects: the requested ones, else a compact grid.

    Raises:
        LayoutError: if the requested numbers do not suit the objects.
    """
    if rows is not None and columns is not None:
        if rows * columns != count:
            raise LayoutError(f"a grid of {rows} by {columns} takes {rows * columns} objects, got {count}")
        if min(rows, columns) < 2:
            raise LayoutError(f"a grid of {rows} by {columns} is a line; a grid has 2 or more rows and columns")
        return rows, columns
    able = [
        one for one in divisions(count) if (rows is None or one[0] == rows) and (columns is None or one[1] == columns)
    ]
    if not able:
        asked = f"{rows} rows" if rows is not None else f"{columns} columns"
        raise LayoutError(
            f"{count} objects cannot form a grid of {asked} in which only the last row is short, and none is a line"
        )
    return min(able, key=lambda one: one[0] * one[1] - count + _OBLONG * abs(one[1] - one[0]) + (one[0] > one[1]) * 0.1)


def _neighbours_of(numbers: np.ndarray) -> list[list[tuple[int, int]]]:
    """Return the pairs of places (N, 2) next to each other in a column, and those next to each other in a row."""
    found: list[list[tuple[int, int]]] = [[], []]
    for i, one in enumerate(numbers):
        for j, other in enumerate(numbers):
            for axis in (0, 1):
                if other[axis] == one[axis] + 1 and other[1 - axis] == one[1 - axis]:
                    found[axis].append((i, j))
    return found


def _least_step(outlines: Sequence[np.ndarray], numbers: np.ndarray, axis: int) -> float:
    """Return the pitch (m) in which neighbours along an axis clear each other."""
    direction, least = -np.eye(2)[axis], 0.0
    for i, j in _neighbours_of(numbers)[axis]:
        least = max(least, separation_along(outlines[i], outlines[j], direction))
    return least
