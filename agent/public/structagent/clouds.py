"""Check a caller's clouds, colours, names and table; each is refused in one sentence."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely

from structagent.arguments import LONGEST_NAME, as_array, bad_input, is_listing, shown, wrong_argument
from structdiffusion.observation import Table

FEWEST_POINTS = 20  # as of an object that the simulated camera counts as seen
LARGEST = 0.5  # m across: what is wider is taken for furniture in recordings too
SMALLEST = 0.002  # m across: less is one point with noise, or a cloud in another unit
THINNEST = 0.0005  # m across seen from above: less is a line, of which no outline can be made
FARTHEST_OFF_TABLE = 0.5  # m, of a cloud's middle beyond the table's edge
LOWEST, HIGHEST = -0.05, 0.6  # m, of a cloud's lowest point over the table top
MOST_CLOUDS = 40  # as a scene file may have
SMALLEST_TABLE, LARGEST_TABLE = 0.1, 5.0  # m, a side
WORLD_FRAME = "the world frame has z = 0 on the table top, x away from the robot and y to its left"


def checked_clouds(clouds: Any) -> list[np.ndarray]:
    """Check clouds, and return them as read-only float32 arrays (P, 3), copied.

    Raises:
        StructagentError: for a wrong shape, dtype, unit or place, too few points, and coordinates that are not finite.
    """
    legal = "a list of (P, 3) arrays, one for each object, or one (N, P, 3) array"
    if not is_listing(clouds):
        raise bad_input(f"clouds cannot be {shown(clouds)}; legal: {legal}")
    listed = getattr(clouds, "ndim", None) == 1 and clouds.dtype == object
    if getattr(clouds, "ndim", 3) != 3 and not listed:
        raise bad_input(f"clouds is an array of shape {tuple(clouds.shape)}; legal: {legal}")
    if len(clouds) == 0:
        raise bad_input(f"clouds is empty; legal: {legal}, at least 2 clouds")
    if len(clouds) > MOST_CLOUDS:
        raise bad_input(f"clouds has {len(clouds)} objects; legal: 2 to {MOST_CLOUDS}")
    return [_checked_cloud(cloud, f"clouds[{index}]") for index, cloud in enumerate(clouds)]


def _checked_cloud(cloud: Any, place: str) -> np.ndarray:
    legal = "an array (P, 3) of numbers, x, y and z in metres"
    array = as_array(cloud, place, legal)
    if array.ndim != 2 or array.shape[1] != 3:
        hint = "; colours go into colors=" if array.ndim == 2 and array.shape[1] in (4, 6, 7) else ""
        raise bad_input(f"{place} has the shape {array.shape}; legal: {legal}{hint}")
    if len(array) < FEWEST_POINTS:
        raise bad_input(f"{place} has {len(array)} points; legal: {FEWEST_POINTS} or more")
    finite = np.isfinite(array).all(axis=1)
    if not finite.all():
        row = int(np.flatnonzero(~finite)[0])
        raise bad_input(
            f"{place} has a coordinate that is not finite at point {row} ({array[row].tolist()}), and "
            f"{(~finite).sum()} "
            f"such points; leave them out, as {place}[np.isfinite({place}).all(axis=1)]"
        )
    # Judged as float64: integers of eight bits would overflow, and float32 makes large numbers infinite.
    _check_size(array.astype(np.float64), place)
    points = array.astype(np.float32)
    points.flags.writeable = False
    return points


def _check_size(points: np.ndarray, place: str) -> None:
    sides = points.max(axis=0) - points.min(axis=0)
    across = float(sides.max())
    if across > LARGEST:
        raise bad_input(
            f"{place} is {across:.4g} m across; legal: {SMALLEST} to {LARGEST} m, because clouds are in "
            f"metres{_unit(across)}"
        )
    if across < SMALLEST:
        raise bad_input(
            f"{place} is {across:.4g} m across, hardly more than one point; legal: {SMALLEST} to {LARGEST} m"
        )
    corners = shapely.LineString(points[:, :2]).minimum_rotated_rectangle
    width = corners.area / max(corners.length / 2, 1e-12) if corners.geom_type == "Polygon" else 0.0
    if width < THINNEST:
        raise bad_input(
            f"{place} is {1000 * width:.2f} mm wide seen from above: its points lie on one line there, and no outline "
            f"of the object can be made; legal: {1000 * THINNEST:g} mm or more"
        )


def _unit(across: float) -> str:
    for name, factor in (("centimetres", 100.0), ("millimetres", 1000.0)):
        if 0.02 <= across / factor <= 0.3:  # what an object for a table is across
            return f"; are these {name}? Divide them by {factor:g}"
    return ""


def check_places(clouds: Sequence[np.ndarray], table: Table, bottoms: Sequence[float]) -> None:
    """Refuse clouds that stand nowhere near the table.

    Raises:
        StructagentError: with the place of the first such cloud, and the legal range.
    """
    for index, (points, bottom) in enumerate(zip(clouds, bottoms, strict=True)):
        place, low = f"clouds[{index}]", float(points[:, 2].min())
        x, y = (float(part) for part in points[:, :2].mean(axis=0))
        off = table.overhang(np.array([[x, y]]))
        if off > FARTHEST_OFF_TABLE:
            raise bad_input(
                f"{place} lies about x {x:.4g}, y {y:.4g}, which is {off:.2f} m off the table (x {table.x_min:g} to "
                f"{table.x_max:g}, y {table.y_min:g} to {table.y_max:g}; m); legal: at most {FARTHEST_OFF_TABLE} m "
                f"off; {WORLD_FRAME}; another rectangle is given as table="
            )
        if not LOWEST <= low <= HIGHEST:
            raise bad_input(
                f"the lowest point of {place} is at z {low:.4g} m; legal: {LOWEST} to {HIGHEST} m, because "
                f"{WORLD_FRAME}"
            )
        if low < bottom + LOWEST:
            raise bad_input(
                f"bottoms[{index}] is {bottom:g} m, and the lowest point of {place} is below that, at z {low:.3f} m"
            )


def checked_colors(colors: Any, clouds: Sequence[np.ndarray]) -> tuple[np.ndarray | None, ...]:
    """Check the colours of each cloud (P, 3) and return them as (P, 3) uint8, read-only; `None` if none are given.

    Raises:
        StructagentError: for another number of entries, shape or range.
    """
    if colors is None:
        return (None,) * len(clouds)
    legal = "for each cloud None, an RGB triple, or an array (P, 3): integers of 0 to 255, or floats of 0 to 1"
    if not is_listing(colors):
        raise bad_input(f"colors cannot be {shown(colors)}; legal: {legal}")
    if len(colors) != len(clouds):
        raise bad_input(f"colors has {len(colors)} entries and clouds {len(clouds)}; legal: {legal}")
    return tuple(
        None if entry is None else _checked_color(entry, len(points), f"colors[{index}]", legal)
        for index, (entry, points) in enumerate(zip(colors, clouds, strict=True))
    )


def _checked_color(entry: Any, count: int, place: str, legal: str) -> np.ndarray:
    array = as_array(entry, place, legal)
    if array.shape not in ((3,), (count, 3)):
        raise bad_input(f"{place} has the shape {array.shape}, and its cloud {count} points; legal: {legal}")
    most = 1 if array.dtype.kind == "f" else 255
    if not (np.isfinite(array).all() and array.min() >= 0 and array.max() <= most):
        raise bad_input(
            f"{place} has the dtype {array.dtype} and values of {array.min():g} to {array.max():g}; legal: {legal}"
        )
    whole = np.rint(array * 255) if most == 1 else array
    levels = np.array(np.broadcast_to(whole, (count, 3)), dtype=np.uint8)
    levels.flags.writeable = False
    return levels


def checked_names(names: Any, count: int, place: str = "names") -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Check names, and return them once unique ("cup 1", "cup 2") and once as they were given.

    An object without a name is "object 3" by its number, counted from 1.

    Raises:
        StructagentError: for another number of names, and for anything that is not a name.
    """
    legal = "one name for each cloud, such as 'cup' or 'soup can', or None for an object without a name"
    if names is None:
        names = [None] * count
    if not is_listing(names):
        raise wrong_argument(f"{place} cannot be {shown(names)}; legal: {legal}")
    if len(names) != count:
        raise wrong_argument(f"{place} has {len(names)} entries and clouds {count}; legal: {legal}")
    given = tuple(_checked_name(name, f"{place}[{index}]", legal) for index, name in enumerate(names))
    number, taken = Counter(given), {name for name in given if given.count(name) == 1}
    unique = []
    for index, name in enumerate(given):
        if name and number[name] == 1:
            unique.append(name)
            continue
        stem, k = name or "object", 1 if name else index + 1
        while f"{stem} {k}" in taken:
            k += 1
        taken.add(f"{stem} {k}")
        unique.append(f"{stem} {k}")
    return tuple(unique), given


def _checked_name(name: Any, place: str, legal: str) -> str:
    if name is None:
        return ""
    if not isinstance(name, str):
        raise wrong_argument(f"{place} cannot be {shown(name)}; legal: {legal}")
    if len(name) > LONGEST_NAME or not name.isprintable():
        raise wrong_argument(f"{place} must be one printable line of at most {LONGEST_NAME} characters")
    return " ".join(name.split())


def checked_bottoms(bottoms: Any, count: int) -> tuple[float, ...]:
    """Check and return z of the surface below each object, metres; by default 0, the table top.

    Raises:
        StructagentError: for another number of entries, or heights outside of 0 to `HIGHEST`.
    """
    if bottoms is None:
        return (0.0,) * count
    legal = f"for each cloud the z of what it stands on, 0 to {HIGHEST} m"
    array = as_array(bottoms, "bottoms", legal).astype(np.float64)
    if array.shape != (count,):
        raise bad_input(f"bottoms has the shape {array.shape} and clouds {count} objects; legal: {legal}")
    for index, value in enumerate(array.tolist()):
        if not 0.0 <= value <= HIGHEST:
            raise bad_input(f"bottoms[{index}] is {value:g}; legal: {legal}")
    return tuple(array.tolist())


def checked_table(table: Any) -> Table:
    """Check and return the table top; by default that of the simulated table.

    Raises:
        StructagentError: for anything that is not a rectangle of a table's size.
    """
    if table is None:
        return Table()
    legal = f"(x_min, x_max, y_min, y_max) in metres, world frame, sides of {SMALLEST_TABLE:g} to {LARGEST_TABLE:g} m"
    if isinstance(table, Table):
        table = (table.x_min, table.x_max, table.y_min, table.y_max)
    array = as_array(table, "table", legal).astype(np.float64)
    if array.shape != (4,):
        raise wrong_argument(f"table has the shape {array.shape}; legal: {legal}")
    numbers = array.tolist()
    sides = (numbers[1] - numbers[0], numbers[3] - numbers[2])
    if not all(map(math.isfinite, numbers)) or not all(SMALLEST_TABLE <= side <= LARGEST_TABLE for side in sides):
        raise wrong_argument(f"table cannot be {shown(tuple(numbers))}; legal: {legal}")
    return Table(*numbers)
