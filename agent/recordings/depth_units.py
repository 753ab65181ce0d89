"""Decide in which unit a recording stores depths: in the one that it declares, unless what is seen contradicts that.

A depth camera's data have no scale of their own: 16 bits of grey are millimetres by convention, and quarters or tenths
of them, or fifths, in what some cameras and data sets write. A table scene does have a scale: it is looked at from
about a metre, and what stands on it is about as large as a hand. The planes that carry something are therefore found
without regard to the scale, and each unit is rated by how far away and how large those things would be in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from agent.errors import BadInput, UsageError
from agent.recordings.plane_fitting import largest_plane, thinned

MILLIMETRE = 0.001  # m: the unit of whole numbers, by the convention of ROS (REP 118) and of most data sets
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "0.25mm": 0.00025, "tum": 0.0002, "0.1mm": 0.0001}  # name -> metres
_WORDS = {
    "m": "metres", "cm": "centimetres", "mm": "millimetres", "0.25mm": "quarters of a millimetre",
    "tum": "fifths of a millimetre", "0.1mm": "tenths of a millimetre",
}  # fmt: skip
LEGAL = "metres per stored unit, such as 0.001, or " + ", ".join(UNITS)
IN_BAGS = (0.001, 1.0, 0.00025, 0.0001)  # that drivers publish
IN_PICTURES = (0.001, 1.0, 0.0002, 0.00025, 0.0001)  # that data sets store
IN_CLOUDS = (1.0, 0.001, 0.01, 0.00025, 0.0001)
# What is usual on a table: the middle, and the factor by which two of three scenes differ at most.
_DISTANCE = 1.1, 1.6  # m, from the camera to the table
_SIZE = 0.055, 1.6  # m, of the things on it: their height or their shorter side, whichever is less; the middle
_PLAUSIBLE = 9.0  # sum of the squares of both deviations, in these factors
_DOUBTFUL = 1.0  # from which on the arm's base is asked
_BASE = 0.06  # m: a table on which an arm is mounted lies as high as its base
_CLEARLY = 7.5, 4.0  # by so much the best unit must be better than any other, with things and without
_ANYWHERE = 0.05, 20.0  # m: where the middle of a picture may be that shows no table
_MOST_POINTS = 150_000
_NEAR = 30.0  # percent of the points are nearer than the distance that counts as 1
_FARTHEST = 3.0  # of those distances
_CELL, _WITHIN = 0.006, 0.008  # of that distance: the thinned cloud's cells, and half a plane's thickness
_GRID = 1.5 * _CELL
_GAP = 20  # cells: what hides so much of the plane behind it stands on it all the same
_MOST_PLANES, _LEAST_SHARE, _LEAST_POINTS = 8, 0.03, 300  # of the cells of a plane
_TALLEST, _THINNEST, _LEAST_CELLS = 0.8, 2 * _WITHIN, 15  # of a thing; thinner ones are edges and noise


@dataclass(frozen=True)
class Carrier:
    """A plane that carries something, in stored units.

    Attributes:
        distance: from the camera.
        size: of the things on it.
        foot: (3,) the foot of the camera's perpendicular on it.
    """

    distance: float
    size: float
    foot: np.ndarray


def unit_of(text: str | float) -> float:
    """Return the metres per stored unit that a user gives by a number or a name.

    Raises:
        UsageError: for anything else.
    """
    try:
        metres = UNITS.get(str(text).strip().lower().replace(" ", "")) or float(text)
    except ValueError:
        metres = math.nan
    if not 1e-6 <= metres <= 10.0:
        raise UsageError(f"--depth-unit cannot be {str(text)!r}; legal: {LEGAL}")
    return metres


def named(metres: float) -> str:
    """Say a unit in words."""
    known = (_WORDS[name] for name, value in UNITS.items() if math.isclose(value, metres, rel_tol=1e-3))
    return next(known, f"{metres:g} m")


def fitting_unit(
    points: np.ndarray,
    declared: float,
    candidates: Sequence[float],
    what: str = "the depths",
    base_from_camera: Callable[[], np.ndarray | None] | None = None,
) -> tuple[float, str]:
    """Return the unit of a measurement, metres per stored unit, and a note, or "" where it is the declared one.

    Args:
        points: (..., 3) in stored units, the camera at the origin; NaN or 0 where nothing was measured.
        declared: metres per stored unit by the format, or as a file says.
        candidates: others that come into question by the looks of the scene alone; where tf settles it, any of `UNITS`.
        what: a subject for the note.
        base_from_camera: returns that pose (4, 4) by tf, metres, or `None`; a table as high as the arm's base settles a
            doubt.

    Raises:
        BadInput: if the declared unit cannot be right, and no other or more than one can; it asks for the option.
    """
    flat = _finite(points)
    if not len(flat):
        return declared, ""
    carriers, middle = carrying_planes(flat), float(np.median(np.linalg.norm(flat, axis=1)))
    units = _with(declared, candidates)
    cost = {unit: _cost_of(carriers, middle, unit) for unit in _with(declared, UNITS.values())}
    usual = _ANYWHERE[0] <= middle * declared <= _ANYWHERE[1]
    said = f"in {named(declared)}, {_seen(carriers, declared, middle)}"
    if base_from_camera is not None and cost[declared] > _DOUBTFUL and (base := base_from_camera()) is not None:
        off = {unit: _off_base(carriers, unit, base) for unit in cost if cost[unit] < _PLAUSIBLE}
        level = sorted((unit for unit in off if off[unit] < _BASE), key=off.__getitem__)
        if declared in level:
            return declared, ""
        if level and off[level[0]] < 0.5 * min((off[unit] for unit in level[1:]), default=math.inf):
            how = f"so the table is as high as the arm's base by tf; {said}"
            return level[0], f"{what} were taken to be in {named(level[0])} ({level[0]:g} m a unit): {how}"
    if cost[declared] <= (_PLAUSIBLE if carriers or not usual else math.inf):
        return declared, ""
    best = min(units, key=cost.__getitem__)
    plausible = [unit for unit in units if cost[unit] < _PLAUSIBLE and cost[unit] < cost[best] + _CLEARLY[not carriers]]
    if plausible == [best]:
        return best, f"{what} were taken to be in {named(best)} ({best:g} m a unit): {said}"
    which = f"it may be {' or '.join(map(named, plausible))}" if plausible else "no usual unit fits"
    sentence = f"the unit of {what} is not certain: {said}, and {which}; --depth-unit says it, legal: {LEGAL}"
    if not plausible and usual:
        return declared, sentence
    raise BadInput(sentence)


def _with(declared: float, others: Iterable[float]) -> list[float]:
    """Return the declared unit, then the others that differ from it."""
    return [declared, *(unit for unit in others if not math.isclose(unit, declared, rel_tol=1e-3))]


def _cost_of(carriers: Sequence[Carrier], middle: float, unit: float) -> float:
    """Rate how unusual a unit would make what is seen; 0 is the most usual."""
    return min((_cost(each, unit) for each in carriers), default=_deviation(middle * unit, *_DISTANCE) ** 2)


def _off_base(carriers: Sequence[Carrier], unit: float, base_from_camera: np.ndarray) -> float:
    """Return by how much, metres, the level plane that is nearest to the height of the arm's base misses it."""
    up, height = base_from_camera[2, :3], base_from_camera[2, 3]
    return min(
        (
            abs(float(up @ each.foot) * unit + height)
            for each in carriers
            if -(up @ each.foot) > 0.95 * np.linalg.norm(each.foot)
        ),
        default=math.inf,
    )


def in_metres(points: np.ndarray, given: float | None, what: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return points (P, 3) of a cloud in metres, and notes.

    Args:
        points: in the cloud's unit.
        given: metres per unit that the user says, or `None`.
        what: a subject for the notes, such as "the coordinates in 'desk.ply'".

    Raises:
        BadInput: as `fitting_unit`.
    """
    unit, said = fitting_unit(points, 1.0, IN_CLOUDS, what) if given is None else (given, "")
    return points if unit == 1.0 else points * np.float32(unit), (said,) if said else ()


def _finite(points: np.ndarray) -> np.ndarray:
    """Return some of the points (P, 3) that measure something."""
    flat = points.reshape(-1, 3)
    flat = flat[:: max(1, len(flat) // (10 * _MOST_POINTS))]
    flat = flat[np.isfinite(flat).all(axis=1) & (flat != 0).any(axis=1)]
    if len(flat) > _MOST_POINTS:
        flat = flat[np.linspace(0, len(flat) - 1, _MOST_POINTS).astype(int)]
    return flat.astype(np.float64)


def _cost(carrier: Carrier, unit: float) -> float:
    return _deviation(carrier.distance * unit, *_DISTANCE) ** 2 + _deviation(carrier.size * unit, *_SIZE) ** 2


def _deviation(value: float, middle: float, factor: float) -> float:
    return math.log(max(value, 1e-12) / middle) / math.log(factor)


def _seen(carriers: Sequence[Carrier], unit: float, middle: float) -> str:
    if not carriers:
        return f"what is seen would be {middle * unit:.3g} m away"
    nearest = min(carriers, key=lambda each: _cost(each, unit))
    return (
        f"the table would be {nearest.distance * unit:.3g} m away, and half of the things on it more than "
        f"{nearest.size * unit:.2g} m thick"
    )


def carrying_planes(points: np.ndarray) -> list[Carrier]:
    """Return the planes among points (P, 3), all finite and in any unit, that carry something."""
    distances = np.linalg.norm(points, axis=1)
    one = float(np.percentile(distances, _NEAR))
    if len(points) < _LEAST_POINTS:
        return []
    thin = thinned(points[distances < _FARTHEST * one] / one, _CELL)
    rng, rest, found = np.random.default_rng(0), thin, []  # the same points give the same planes
    for _ in range(_MOST_PLANES):
        if len(rest) < _LEAST_POINTS:
            break
        plane, inliers = largest_plane(rest, _WITHIN, rng)
        if inliers.sum() < max(_LEAST_SHARE * len(thin), _LEAST_POINTS):
            break
        if (carried := _carried(plane if plane[3] > 0 else -plane, thin)) is not None:
            found.append(Carrier(carried.distance * one, carried.size * one, carried.foot * one))
        rest = rest[~inliers]
    return found


def _carried(plane: np.ndarray, thin: np.ndarray) -> Carrier | None:
    """Return what a plane (4,) carries, its normal toward the camera; `None` if nothing stands on it."""
    from scipy import ndimage  # not above: every command with the option --depth-unit looks at its units

    normal, height = plane[:3], thin @ plane[:3] + plane[3]
    flat, above = np.abs(height) < _WITHIN, np.flatnonzero((height > 1.5 * _WITHIN) & (height < _TALLEST))
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    across /= np.linalg.norm(across)
    level = thin @ np.stack((across, np.cross(normal, across)), axis=1)
    corner = level[flat].min(axis=0) - _GAP * _GRID
    size = ((level[flat].max(axis=0) - corner) / _GRID).astype(int) + _GAP + 1
    surface = np.zeros(size, dtype=bool)
    surface[tuple(((level[flat] - corner) / _GRID).astype(int).T)] = True
    surface = ndimage.binary_fill_holes(ndimage.binary_closing(surface, iterations=_GAP // 2))
    place = np.floor((level[above] - corner) / _GRID).astype(int)
    inside = ((place >= 0) & (place < size)).all(axis=1)
    above, place = above[inside], place[inside]
    things = np.zeros(size, dtype=bool)
    things[tuple(place.T)] = True
    parts, count = ndimage.label(things & surface, np.ones((3, 3)))
    part = parts[tuple(place.T)]
    sizes = []
    for number in range(1, count + 1):
        mine = above[part == number]
        if len(mine) >= _LEAST_CELLS:
            spread = level[mine] - level[mine].mean(axis=0)
            sides = np.ptp(spread @ np.linalg.eigh(spread.T @ spread)[1], axis=0) + _CELL
            if (thickness := min(float(sides.min()), float(height[mine].max()))) > _THINNEST:
                sizes.append((thickness, math.sqrt(len(mine))))
    if not sizes:
        return None
    distance = float(np.median(np.linalg.norm(thin[flat], axis=1)))
    values, weights = np.array(sorted(sizes)).T  # crumbs of noise weigh less than things
    middle = values[np.searchsorted(np.cumsum(weights), weights.sum() / 2)]
    return Carrier(distance, float(middle), -plane[3] * normal)
