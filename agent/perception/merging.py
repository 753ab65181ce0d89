"""Merge parts of one object: the inside of a mug and its outside, a plate's rim and its middle."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import cKDTree

from agent.perception.color import differ
from agent.perception.hollow_objects import hollow_objects_joined, hollowness

_WITHIN = 0.5  # of the smaller part's outline, seen from above, lies in the other's: apart, they would intersect
_RIM = 0.04  # m between the inside and the outside: a wall, and what the camera loses of it
_RIM_HEIGHT = 0.02  # m between their upper ends
_THING = 80  # voxels: what is smaller is a splinter of what it stands in
_SOLID = 0.45  # hollowness of what stands in a bowl at least
_UNDER = 0.015  # m below the surface about it, up to where the foot of what stands there is seen
_FLAT = 0.03  # m: what is lower, and next to another such thing, is one with it
_SPECK = 8  # voxels: fewer are noise
_IN_THE_AIR = 0.02  # m above the table: what ends higher is held by something
_MINOR = 0.3  # of the voxels of what it is a part of
_BESIDE = 0.03  # m from it
_ALIKE = 18.0  # apart in CIELAB: one colour in light and shade


def joined(part: np.ndarray, positions: np.ndarray, normals: np.ndarray, lab: np.ndarray | None) -> np.ndarray:
    """Join parts that occupy the same place, or are the inside and the outside of one object.

    Args:
        part: (V,) the part of each voxel, -1 for none.
        positions: (V, 3) level frame, metres.
        normals: (V, 3) unit, toward the camera.
        lab: (V, 3) colours in CIELAB, or `None`.
    """
    part = hollow_objects_joined(part, positions, normals)
    part = _floaters_joined(part, positions, lab)
    outlines = {k: _outline(positions[part == k]) for k in np.unique(part[part >= 0])}
    while pair := _intersecting(outlines, part, positions, normals, lab):
        small, large = pair
        part[part == small] = large
        outlines[large] = _outline(positions[part == large])
        del outlines[small]
    return hollow_objects_joined(part, positions, normals)  # their walls are whole now


def _own_object(
    small: int, large: int, part: np.ndarray, positions: np.ndarray, normals: np.ndarray, lab: np.ndarray | None
) -> bool:
    """Return whether a part in the place of a larger one is an object that stands on it, or in it."""
    own, other = positions[part == small], positions[part == large]
    if len(own) < _THING:
        return False
    if differ(lab, part == small, part == large):
        return True
    if np.percentile(own[:, 2], 95) < np.percentile(other[:, 2], 95) + _RIM_HEIGHT:
        # In a bowl: the bowl's own inside looks hollow, and what is in it solid.
        return hollowness(own, normals[part == small]) > _SOLID
    beside = cKDTree(own[:, :2]).query(other[:, :2])[0] < _RIM
    return not beside.any() or np.percentile(own[:, 2], 5) > np.percentile(other[beside, 2], 50) - _UNDER


def flat_things_joined(part: np.ndarray, positions: np.ndarray, reach: float) -> np.ndarray:
    """Join parts (V,) that are low and next to each other: a spoon's bowl is higher than its handle.

    Args:
        part: (V,) the part of each voxel, -1 for none.
        positions: (V, 3) level frame, metres.
        reach: metres within which voxels are neighbours.
    """
    part = part.copy()
    low = [
        k for k, size in zip(*np.unique(part[part >= 0], return_counts=True), strict=True)
        if size >= _SPECK and positions[part == k, 2].max() < _FLAT
    ]  # fmt: skip
    trees = {k: cKDTree(positions[part == k]) for k in low}
    for place, one in enumerate(low):
        for other in low[place + 1 :]:
            if trees[one].sparse_distance_matrix(trees[other], 1.2 * reach).nnz:
                part[part == one] = other
                trees[other] = cKDTree(positions[part == other])
                break
    return part


def _floaters_joined(part: np.ndarray, positions: np.ndarray, lab: np.ndarray | None) -> np.ndarray:
    """Join parts that float beside a larger part of their colour: a handle behind its mug."""
    part = part.copy()
    sizes = np.bincount(part[part >= 0])
    for small in np.argsort(sizes):
        own = part == small
        if not own.any() or positions[own, 2].min() < _IN_THE_AIR:
            continue
        others = (part >= 0) & ~own & (sizes[part] * _MINOR > own.sum())
        if not others.any():
            continue
        away, nearest = cKDTree(positions[others]).query(positions[own])
        other = part[others][nearest[away.argmin()]]
        body = part == other
        alike = lab is None or np.linalg.norm(np.median(lab[own], axis=0) - np.median(lab[body], axis=0)) < _ALIKE
        if away.min() < _BESIDE and alike and positions[own, 2].max() < positions[body, 2].max() + _RIM_HEIGHT:
            part[own] = other
    return part


def _intersecting(
    outlines: dict[int, shapely.Polygon],
    part: np.ndarray,
    positions: np.ndarray,
    normals: np.ndarray,
    lab: np.ndarray | None,
) -> tuple[int, int] | None:
    """Return two parts of which the smaller, seen from above, lies in the larger and is no object of its own."""
    order = sorted(outlines, key=lambda k: outlines[k].area)
    for place, small in enumerate(order):
        for large in order[place + 1 :]:
            shared = outlines[small].intersection(outlines[large]).area
            if shared > _WITHIN * outlines[small].area and not _own_object(small, large, part, positions, normals, lab):
                return small, large
    return None


def _outline(positions: np.ndarray) -> shapely.Polygon:
    return shapely.multipoints(positions[:, :2]).convex_hull.buffer(0.002)
