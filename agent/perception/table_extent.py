"""Find the extent of the table: the rectangle that was seen, and the part of it that the arm reaches."""

from __future__ import annotations

import numpy as np
import shapely

from structdiffusion.observation import Table

_STEPS = 80  # in x, between which the largest rectangle is sought
_LEAST = 0.2  # m, either way, of a table to build on
_UNSEEN = 0.03  # m of the arm's reach without a table, from which it is noted: less keeps nothing from being built


def seen_rectangle(outline: np.ndarray, footprints: np.ndarray) -> Table:
    """Return the largest axis-aligned rectangle in the table's convex outline, enlarged until it holds every object.

    Args:
        outline: (K, 2) world frame, metres.
        footprints: (P, 2) the objects' points.
    """
    polygon = shapely.Polygon(outline).convex_hull
    x_low, y_low, x_high, y_high = polygon.bounds
    x = np.linspace(x_low, x_high, _STEPS + 2)[1:-1]
    chords = shapely.intersection(polygon, [shapely.LineString([(v, y_low - 1), (v, y_high + 1)]) for v in x])
    bounds = shapely.bounds(chords)
    # In a convex outline, what both sides of a rectangle hold, all between them holds.
    low, high = np.maximum.outer(bounds[:, 1], bounds[:, 1]), np.minimum.outer(bounds[:, 3], bounds[:, 3])
    area = np.clip(high - low, 0.0, None) * (x[None, :] - x[:, None])
    first, last = np.unravel_index(area.argmax(), area.shape)
    corners = np.array([[x[first], low[first, last]], [x[last], high[first, last]]])
    held = np.vstack((corners, footprints))
    (x_min, y_min), (x_max, y_max) = held.min(axis=0), held.max(axis=0)
    return Table(float(x_min), float(x_max), float(y_min), float(y_max))


def reachable(surface: Table) -> tuple[Table, tuple[str, ...]]:
    """Return the part of the surface that the arm reaches, enlarged to the least size that can be built on, and notes:
    where it was enlarged, or less was seen than the arm reaches.
    """
    reach = Table()
    x_min, x_max, extended_x = _shared(surface.x_min, surface.x_max, reach.x_min, reach.x_max)
    y_min, y_max, extended_y = _shared(surface.y_min, surface.y_max, reach.y_min, reach.y_max)
    notes: tuple[str, ...] = ()
    if extended_x or extended_y:
        notes = (
            f"the arm reaches x {reach.x_min} to {reach.x_max}, y {reach.y_min} to {reach.y_max} m, and the table that "
            f"was seen spans x {surface.x_min:.2f} to {surface.x_max:.2f}, y {surface.y_min:.2f} to "
            f"{surface.y_max:.2f} m: less than {_LEAST} m are in both, and what is built on goes beyond",
        )
    elif max(x_min - reach.x_min, reach.x_max - x_max, y_min - reach.y_min, reach.y_max - y_max) > _UNSEEN:
        notes = (
            f"of what the arm reaches, the table was seen from x {x_min:.2f} to {x_max:.2f} and from y {y_min:.2f} to "
            f"{y_max:.2f} m; nothing is built beyond",
        )
    return Table(x_min, x_max, y_min, y_max), notes


def _shared(low: float, high: float, reach_low: float, reach_high: float) -> tuple[float, float, bool]:
    """Return the shared part of two ranges, and whether it had to be extended."""
    first, last = max(low, reach_low), min(high, reach_high)
    if last - first >= _LEAST:
        return first, last, False
    # About the end of the table that is nearest to what the arm reaches.
    middle = min(max((first + last) / 2, reach_low + _LEAST / 2), reach_high - _LEAST / 2)
    middle = min(max(middle, low), high)
    return middle - _LEAST / 2, middle + _LEAST / 2, True
