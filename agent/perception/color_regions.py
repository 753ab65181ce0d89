"""Divide objects at the borders of plain colours: a red fork on a green plate, a blue cup on a yellow one.

Colour alone says little, for most things are printed and many have two colours. An object is divided only where it
consists of a few regions, each of one colour throughout, and where the shapes of two regions are those of two things:
one lies on the other, with a step all around; or stands on it; or beside it; or behind it. A mug with a coloured
inside, a knife with a handle, and a bottle with a cap stay whole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from agent.perception.color_division import shadeless
from agent.perception.hollow_objects import hollow_objects_joined, hollowness
from agent.perception.splitting import split

_STEP_OF_COLOR = 7.0  # between neighbouring voxels of one colour, without shade
_APART = 18.0  # between the medians of two colours, without shade
_OWN, _PLAIN = 12.0, 0.85  # from its region's median is this share of its voxels, without those that mix two colours
_LEAST, _MOST = 40, 4  # voxels of a region, and regions; more are a print
_KNOWN = 0.6  # of the voxels are in regions; the others, which mix two colours, are given to the nearest
_BORDER = 8  # pairs of voxels at least
_HOLLOW = -0.3  # the inside of a vessel
_ON = 0.6  # of an outline is above what it lies on
_NEAR_STEP, _STEP = 0.014, 0.0025  # m around a voxel, and m that it is higher than what is there
_ALL_AROUND = 0.8  # of the voxels there are higher at all
_TOP, _TOP_SHARE, _UP = 0.03, 0.4, 0.7  # m around it; voxels of a surface that faces up there, times its own; z of it
_SUNK = 0.02  # m that the lower end of what lies on a surface is below it at most: it may lie across the edge
_AS_HIGH_AS_LONG = 1.2  # times as high as long is what things lie on at most
_ABOVE = 0.008  # m by which the upper end of what carries another may be above its lower end
_HIGH = 0.015  # m that each part of a stack is high
_HALF = 0.25  # of the voxels of both has each part of a stack
_WIDE = 0.6  # times as wide as what carries it is what is not the cap of it
_FOOT, _DOWN = 0.025, 0.4  # m, or share of its height, at which what stands beside another ends below
_SHARED = 0.4  # of the smaller outline lies in the other at most
_LOW, _NARROW = 0.035, 0.03  # m: what is higher and narrower is a handle
_LONG, _END = 2.5, 0.25  # times as long as wide, and share of its length that two parts, end to end, have in common
_OF_ONE_VESSEL = 0.04  # m between the inside and the outside of a vessel
_BEHIND, _ALIGNED = 0.012, 0.012  # m, and radians between lines of sight


@dataclass(frozen=True)
class _Region:
    """A part of an object in one colour: its voxels' positions (V, 3), normals (V, 3), and outline from above."""

    positions: np.ndarray
    normals: np.ndarray
    outline: shapely.Geometry

    @classmethod
    def of(cls, positions: np.ndarray, normals: np.ndarray) -> _Region:
        return cls(positions, normals, shapely.multipoints(positions[:, :2]).convex_hull.buffer(0.002))

    def height(self, percent: float) -> float:
        return float(np.percentile(self.positions[:, 2], percent))

    @property
    def sides(self) -> np.ndarray:
        """Return the shorter and the longer side (2,), metres, of the box around the outline."""
        corners = np.array(self.outline.minimum_rotated_rectangle.exterior.coords)
        return np.sort(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1))


def divided_by_regions(
    part: np.ndarray,
    positions: np.ndarray,
    normals: np.ndarray,
    lab: np.ndarray,
    fringe: np.ndarray,
    eye: np.ndarray,
    reach: float,
) -> np.ndarray:
    """Return the object (V,) of each voxel, with those divided that are several plain things.

    Args:
        part: (V,) the object of each voxel, -1 for none.
        positions: (V, 3) above the table, level frame, metres.
        normals: (V, 3) unit, toward the camera.
        lab: (V, 3) colours in CIELAB.
        fringe: (V,) whether a voxel has the table's colour: at the edges of objects, depth and colour do not match.
        eye: (3,) where the camera is.
        reach: metres within which voxels are neighbours.
    """
    part, shades = part.copy(), shadeless(lab)
    divided: list[int] = []
    for index in np.unique(part[part >= 0]):
        own = np.flatnonzero(part == index)
        if len(own) < 2 * _LEAST:
            continue
        pairs = cKDTree(positions[own]).query_pairs(reach, output_type="ndarray")
        region = _regions(positions[own], shades[own], fringe[own], pairs)
        thing = _things(region, positions[own], normals[own], shades[own], pairs, eye)
        for number in range(1, int(thing.max()) + 1):
            part[own[thing == number]] = part.max() + 1
        if thing.any():
            divided.extend(np.unique(part[own]))
    return _with_its_own(part, divided, positions, normals, lab, eye, reach)


def _with_its_own(
    part: np.ndarray,
    divided: list[int],
    positions: np.ndarray,
    normals: np.ndarray,
    lab: np.ndarray,
    eye: np.ndarray,
    reach: float,
) -> np.ndarray:
    """Return the object (V,) of each voxel: what was divided may hold a piece of the neighbour, in the neighbour's
    colour, which is one shape with it.
    """
    shades = shadeless(lab)
    for piece in divided:
        own = part == piece
        one, color = _Region.of(positions[own], normals[own]), np.median(shades[own], axis=0)
        away = cKDTree(positions[own]).query(positions, distance_upper_bound=_OF_ONE_VESSEL)[0]
        for other in np.setdiff1d(part[(part >= 0) & (away < _OF_ONE_VESSEL)], divided):
            its = part == other
            if np.linalg.norm(color - np.median(shades[its], axis=0)) > _STEP_OF_COLOR:
                continue
            two = _Region.of(positions[its], normals[its])
            touches = (away[its] < reach).sum() >= _BORDER
            both = np.vstack((lab[own], lab[its]))
            if _are_one_vessel(one, two) or touches and not _are_apart(one, two, both, eye, reach):
                part[own] = other
                break
    return part


def _are_apart(one: _Region, other: _Region, lab: np.ndarray, eye: np.ndarray, reach: float) -> bool:
    """Return whether two parts of one colour stand on or beside each other, with a valley or a neck between them."""
    if not (_stands_on(one, other) or _stands_on(other, one) or _are_beside(one, other)):
        return False
    positions, normals = np.vstack((one.positions, other.positions)), np.vstack((one.normals, other.normals))
    return bool(split(np.zeros(len(positions), dtype=np.int64), positions, normals, lab, eye, reach).any())


def _regions(positions: np.ndarray, shades: np.ndarray, fringe: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Return the region (V,) of each voxel, counted from 0; all 0 where the colours are no plain ones."""
    nothing = np.zeros(len(positions), dtype=np.int64)
    alike = np.linalg.norm(shades[pairs[:, 0]] - shades[pairs[:, 1]], axis=1) < _STEP_OF_COLOR
    alike &= ~fringe[pairs].any(axis=1)
    graph = coo_matrix((np.ones(alike.sum()), pairs[alike].T), shape=(len(positions), len(positions)))
    component = connected_components(graph, directed=False)[1]
    large = np.flatnonzero(np.bincount(component) >= _LEAST)
    medians = np.array([np.median(shades[component == k], axis=0) for k in large]).reshape(-1, 3)
    # What lies across a plate divides the plate in two: one colour is one region.
    near = np.linalg.norm(medians[:, None] - medians[None], axis=2) < _APART
    count, same = connected_components(near, directed=False)
    known = np.isin(component, large)
    if not 2 <= count <= _MOST or known.mean() < _KNOWN:
        return nothing
    region = np.full(len(positions), -1)
    for k, number in zip(large, same, strict=True):
        region[component == k] = number
    for number in range(count):
        own = shades[region == number]
        if (np.linalg.norm(own - np.median(own, axis=0), axis=1) < _OWN).mean() < _PLAIN:
            return nothing
    region[~known] = region[known][cKDTree(positions[known]).query(positions[~known])[1]]
    return region


def _things(
    region: np.ndarray,
    positions: np.ndarray,
    normals: np.ndarray,
    shades: np.ndarray,
    pairs: np.ndarray,
    eye: np.ndarray,
) -> np.ndarray:
    """Return the thing (V,) of each voxel, counted from 0: regions are one thing unless their shapes
    are those of two.
    """
    count = int(region.max()) + 1
    if count == 1:
        return region
    regions = [_Region.of(positions[region == k], normals[region == k]) for k in range(count)]
    one_thing, alone = np.eye(count, dtype=bool), np.ones(count, dtype=bool)
    for first in range(count):
        for second in range(first):
            across = (region[pairs] == first).any(axis=1) & (region[pairs] == second).any(axis=1)
            if across.sum() < _BORDER:
                continue
            alone[[first, second]] = False
            one_thing[first, second] = not _are_two(regions[first], regions[second], eye)
    largest = int(np.bincount(region).argmax())
    for lone in np.flatnonzero(alone):
        one_thing[lone, largest] = not _are_two(regions[lone], regions[largest], eye)
    return np.asarray(connected_components(one_thing, directed=False)[1])[region]


def _are_two(one: _Region, other: _Region, eye: np.ndarray) -> bool:
    """Return whether two regions that meet are two things."""
    if _lies_on(one, other) or _lies_on(other, one):
        return True
    if _overlap(one, other) > _ON and (_is_hollow(one) or _is_hollow(other)) or _are_one_vessel(one, other):
        return False
    return (
        _stands_on(one, other)
        or _stands_on(other, one)
        or _are_beside(one, other)
        or _is_behind(one, other, eye)
        or _is_behind(other, one, eye)
    )


def _overlap(one: _Region, other: _Region) -> float:
    """Return which share of the smaller outline lies in the other."""
    return one.outline.intersection(other.outline).area / min(one.outline.area, other.outline.area)


def _is_hollow(region: _Region) -> bool:
    return hollowness(region.positions, region.normals) < _HOLLOW


def _are_one_vessel(one: _Region, other: _Region) -> bool:
    half = np.repeat((0, 1), (len(one.positions), len(other.positions)))
    both = (np.vstack((getattr(one, name), getattr(other, name))) for name in ("positions", "normals"))
    return len(np.unique(hollow_objects_joined(half, *both))) == 1


def _lies_on(upper: _Region, lower: _Region) -> bool:
    """Return whether a thing lies on a surface that faces up and reaches farther than it, with a step around it."""
    if upper.outline.intersection(lower.outline).area < _ON * upper.outline.area or _is_hollow(upper):
        return False
    if lower.height(97) > _AS_HIGH_AS_LONG * lower.sides[1]:  # a bottle with its cap
        return False
    up = lower.normals[:, 2] > _UP
    tops, facing = lower.positions[up], lower.normals[up]
    if not len(tops) or upper.height(3) < np.median(tops[:, 2]) - _SUNK:
        return False
    around = cKDTree(upper.positions[:, :2]).query(tops[:, :2], distance_upper_bound=_TOP)[0] < _TOP
    if around.sum() < _TOP_SHARE * len(upper.positions):
        return False
    # Only surfaces that face up: below a print on a box there are its sides. And these are continued, for a print in
    # the middle of a ball is higher than what is around it.
    near = cKDTree(tops[:, :2]).query_ball_point(upper.positions[:, :2], _NEAR_STEP)
    steps = np.array([
        point[2] - np.median(_continued(tops[those], facing[those], point))
        for point, those in zip(upper.positions, near, strict=True)
        if those
    ])  # fmt: skip
    return len(steps) >= _BORDER and np.median(steps) > _STEP and (steps > 0).mean() > _ALL_AROUND


def _continued(positions: np.ndarray, normals: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return the heights (K,) at a point of the planes through K voxels."""
    return positions[:, 2] + ((positions - point)[:, :2] * normals[:, :2]).sum(axis=1) / normals[:, 2]


def _stands_on(upper: _Region, lower: _Region) -> bool:
    """Return whether a thing stands on another, or lies across it, and is no cap, lid or rim of it."""
    if upper.height(8) < lower.height(95) - _ABOVE:
        return False
    short, long = upper.sides
    across = long > _LONG * short and long > lower.sides[1] and _overlap(upper, lower) > _SHARED
    if across and upper.height(50) > lower.height(97):  # a pen across a jug
        return True
    if min(each.height(97) - each.height(3) for each in (upper, lower)) < _HIGH:
        return False
    sizes = np.array([len(upper.positions), len(lower.positions)])
    return bool(sizes.min() > _HALF * sizes.sum() and upper.sides[0] > _WIDE * lower.sides[0])


def _are_beside(one: _Region, other: _Region) -> bool:
    """Return whether two things stand beside each other, and are not the two ends of one."""
    for each in (one, other):
        if each.height(3) > max(_FOOT, _DOWN * each.height(97)):
            return False
        if each.height(97) > _LOW and each.sides[0] < _NARROW:
            return False
    return _overlap(one, other) < _SHARED and not _end_to_end(one, other)


def _end_to_end(one: _Region, other: _Region) -> bool:
    """Return whether two regions follow each other along one long shape."""
    both = np.vstack((one.positions, other.positions))[:, :2]
    middle = both.mean(axis=0)
    way = np.linalg.svd(both - middle, full_matrices=False)[2]
    extent = [np.ptp(np.percentile((both - middle) @ axis, (2, 98))) for axis in way]
    if extent[0] < _LONG * extent[1]:
        return False
    (low, high), (its_low, its_high) = (
        np.percentile((each.positions[:, :2] - middle) @ way[0], (2, 98)) for each in (one, other)
    )
    return bool(min(high, its_high) - max(low, its_low) < _END * min(high - low, its_high - its_low))


def _is_behind(back: _Region, front: _Region, eye: np.ndarray) -> bool:
    """Return whether one thing is hidden by another in part: where they meet in the picture, it is farther away."""
    if _overlap(back, front) > _SHARED:
        return False
    (far, away), (near, before) = (_seen(each.positions, eye) for each in (back, front))
    off, nearest = cKDTree(near).query(far, distance_upper_bound=_ALIGNED)
    meets = np.isfinite(off)
    if meets.sum() < _BORDER:
        return False
    return float(np.median(away[meets] - before[nearest[meets]])) > _BEHIND


def _seen(positions: np.ndarray, eye: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the directions (V, 3) and distances (V,) of voxels from the camera."""
    away = np.linalg.norm(positions - eye, axis=1)
    return (positions - eye) / away[:, None], away
