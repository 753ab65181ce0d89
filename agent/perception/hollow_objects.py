"""Join the parts of a vessel: its outside, and its inside and bottom, which a camera sees over the near rim.

One rule decides: the walls of a vessel stand about one axis, and its inside faces that axis. Nothing else on a table
does: what stands in a vessel, or beside it, faces away from its own axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from agent.perception.circle_fitting import circle_through

_WALL = 0.7  # upward part of a normal from which on a surface is no wall
_LEAST_WALL = 10  # voxels
_LEAST = 15  # voxels of a part that is looked at
_NEAR = 0.04  # m between parts of one vessel, seen from above: a wall, and what a camera loses of it
_FACING = 0.35  # mean cosine by which walls face the axis, or away from it
_ABOUT = 0.7  # the same of two pieces of one inside, which have only each other to find the axis by
_RIMS = 0.02  # m that the outside ends above the inside at most; depth edges take more of it than of the inside
_AS_FAR = 0.6  # of the larger distance from the axis is the smaller one
_WIDER = 1.2  # times the larger circle at most is the circle of both: what stands beside a vessel widens it more
_FOOT = 0.03  # m above the lower end of the inside, up to where the outside reaches down
_RIM = 0.005  # m above the walls: the rim itself is level too
_MOST_WALL, _LEVEL = 0.4, 0.2  # of a bottom's voxels are wall, and its hollowness: what stands there faces outward
_INNER_SHARE = 0.8  # of a bottom lies between the walls, seen from above
_RIM_DEPTH = 0.015  # m between a broad rim and the upper end of its walls, and beyond it
_WIDEST_RIM, _RING = 0.15, 0.2  # m of its radius, and the spread of its voxels about a circle, of that: a disc has 0.24


def hollowness(positions: np.ndarray, normals: np.ndarray) -> float:
    """Return how much the normals point away from the part's middle, seen from above: 1 for a ball, -1 for an inside.

    Args:
        positions: (V, 3) metres.
        normals: (V, 3) unit, toward the camera.
    """
    from_middle = positions[:, :2] - positions[:, :2].mean(axis=0)
    weight = np.linalg.norm(normals[:, :2], axis=1) * np.linalg.norm(from_middle, axis=1)
    return float((normals[:, :2] * from_middle).sum() / max(weight.sum(), 1e-9))


@dataclass(frozen=True)
class _Part:
    """A part, its walls and its circle.

    Attributes:
        positions, normals: (V, 3) of its voxels.
        walls: (V,) those of upright surfaces.
        low, high: metres, 5 and 98 percent of its heights.
        outline: its convex outline, seen from above.
    """

    positions: np.ndarray
    normals: np.ndarray
    walls: np.ndarray
    low: float
    high: float
    outline: shapely.Geometry

    @property
    def radius(self) -> float:
        """Return the radius of the least circle around it, metres."""
        return float(shapely.minimum_bounding_radius(self.outline))

    @property
    def has_walls(self) -> bool:
        """Return whether enough of it is upright to tell which way it faces."""
        return int(self.walls.sum()) >= _LEAST_WALL

    def facing(self, axis: np.ndarray) -> tuple[float, float]:
        """Return how much the walls face an axis at (2,), 1 toward it and -1 away, and their mean distance from it."""
        toward = axis - self.positions[self.walls, :2]
        away = np.linalg.norm(toward, axis=1)
        face = (self.normals[self.walls, :2] * toward).sum(axis=1) / np.maximum(away, 1e-9)
        return float(face.mean()), float(away.mean())


def hollow_objects_joined(part: np.ndarray, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Join the parts that are one vessel.

    Args:
        part: (V,) the part of each voxel, -1 for none.
        positions: (V, 3) above the table, metres, z up.
        normals: (V, 3) unit, toward the camera.
    """
    part = part.copy()
    names, sizes = np.unique(part[part >= 0], return_counts=True)
    known = {k: _part(part == k, positions, normals) for k in names[sizes >= _LEAST]}
    waiting = [(one, other) for one in known for other in known if one < other]
    while waiting:
        one, other = waiting.pop()
        if one not in known or other not in known or not _one_vessel(known[one], known[other]):
            continue
        part[part == one] = other
        del known[one]
        known[other] = _part(part == other, positions, normals)  # it has grown: it is compared with all again
        waiting += [(min(other, third), max(other, third)) for third in known if third != other]
    return part


def _part(own: np.ndarray, positions: np.ndarray, normals: np.ndarray) -> _Part:
    mine = positions[own]
    low, high = np.percentile(mine[:, 2], (5, 98))
    outline = shapely.linestrings(mine[:, :2]).convex_hull
    return _Part(mine, normals[own], np.abs(normals[own, 2]) < _WALL, float(low), float(high), outline)


def _one_vessel(one: _Part, other: _Part) -> bool:
    """Return whether two parts belong to one vessel."""
    if one.outline.distance(other.outline) > _NEAR:
        return False
    ways = ((one, other), (other, one))
    return _walls_of_one(one, other) or any(_is_bottom(*way) or _is_rim(*way) for way in ways)


def _walls_of_one(one: _Part, other: _Part) -> bool:
    """Return whether the walls of two parts stand about one axis, and at least one part faces it."""
    if not (one.has_walls and other.has_walls):
        return False
    axis = _axis(one, other)
    (face, away), (its_face, its_away) = one.facing(axis), other.facing(axis)
    inner, outer = (one, other) if face > its_face else (other, one)
    if max(face, its_face) < _FACING or abs(min(face, its_face)) < _FACING:
        return False
    if min(away, its_away) < _AS_FAR * max(away, its_away) or not _ends_in_wall(inner):
        return False
    both = shapely.minimum_bounding_radius(shapely.union(one.outline, other.outline))
    narrow = both < _WIDER * max(one.radius, other.radius)
    if min(face, its_face) > 0:
        return narrow or min(face, its_face) > _ABOUT
    return narrow and outer.high < inner.high + _RIMS and outer.low < inner.low + _FOOT


def _is_bottom(bottom: _Part, vessel: _Part) -> bool:
    """Return whether a part is the level bottom of a vessel: it lies between walls that face it."""
    if not vessel.has_walls or bottom.high > vessel.high + _RIM:
        return False
    if bottom.walls.mean() > _MOST_WALL or hollowness(bottom.positions, bottom.normals) > _LEVEL:
        return False
    axis = np.array(bottom.outline.centroid.coords[0])
    toward = axis - vessel.positions[:, :2]
    inner = vessel.walls & ((vessel.normals[:, :2] * toward).sum(axis=1) > _FACING * np.linalg.norm(toward, axis=1))
    if inner.sum() < _LEAST_WALL or inner.sum() < 0.2 * vessel.walls.sum():
        return False
    within = shapely.contains_xy(vessel.outline.buffer(0.004), bottom.positions[:, 0], bottom.positions[:, 1]).mean()
    return bool(within > _INNER_SHARE)


def _is_rim(rim: _Part, vessel: _Part) -> bool:
    """Return whether a part is the broad rim of a vessel: a level ring, or as much of one as is seen, about the axis
    that its walls face.
    """
    if not vessel.has_walls or abs(rim.low - vessel.high) > _RIM_DEPTH or rim.walls.mean() > _MOST_WALL:
        return False
    axis, radius = circle_through(rim.positions[:, :2])
    off = np.linalg.norm(rim.positions[:, :2] - axis, axis=1) - radius
    if not 0.0 < radius < _WIDEST_RIM or float(np.sqrt(np.mean(off**2))) > _RING * radius:
        return False
    facing, away = vessel.facing(axis)
    return facing > _ABOUT and _AS_FAR * radius < away < radius + _RIM_DEPTH


def _axis(one: _Part, other: _Part) -> np.ndarray:
    """Return the place (2,) that is nearest to the lines along the normals of the walls of both."""
    places = np.vstack((one.positions[one.walls, :2], other.positions[other.walls, :2]))
    level = np.vstack((one.normals[one.walls, :2], other.normals[other.walls, :2]))
    level /= np.maximum(np.linalg.norm(level, axis=1, keepdims=True), 1e-9)
    across = np.eye(2) - level[:, :, None] * level[:, None, :]
    # Where all normals are parallel, it is beside the middle.
    slight = 1e-2 * len(places)
    total = across.sum(axis=0) + slight * np.eye(2)
    return np.linalg.solve(total, (across @ places[:, :, None]).sum(axis=0)[:, 0] + slight * places.mean(axis=0))


def _ends_in_wall(inner: _Part) -> bool:
    """Return whether the upper half of a part is upright: an inside ends in a rim, a solid thing in a top."""
    upper = inner.positions[:, 2] > (inner.low + inner.high) / 2
    return bool(np.median(inner.normals[upper, 2]) < _WALL)
