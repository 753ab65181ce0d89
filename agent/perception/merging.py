"""Merge parts of one object: the inside of a mug and its outside, a plate's rim and its middle."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import cKDTree

_WITHIN = 0.5  # of the smaller part's outline, seen from above, lies in the other's: apart, they would intersect
HOLLOW = -0.3  # the normals of a solid seen from outside diverge (1 for a ball), those of an inside meet (-1)
_CONCAVE, _HOLLOW_WHOLE = -0.04, -0.12  # of a piece of an inside, and of two of them together
_WALL_GAP = 0.02  # m between pieces of an inside
_PIECE = 20  # voxels
_TOP_BAND, _UPRIGHT = 0.012, 0.7  # m below a part's upper end; the upward part of a wall's normals there
_RIM = 0.04  # m between the inside and the outside: a wall, and what the camera loses of it
_AS_WIDE = 0.7  # of the width of both is shared by the inside and the outside, across the line of sight
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


def joined(
    part: np.ndarray,
    positions: np.ndarray,
    normals: np.ndarray,
    lab: np.ndarray | None,
    eye: np.ndarray,
) -> np.ndarray:
    """Join parts that occupy the same place, or are the inside and the outside of one object.

    Args:
        part: (V,) the part of each voxel, -1 for none.
        positions: (V, 3) level frame, metres.
        normals: (V, 3) unit, toward the camera.
        lab: (V, 3) colours in CIELAB, or `None`.
        eye: (3,) where the camera is.
    """
    part = insides_joined(part, positions, normals, _WALL_GAP)
    for hollow in np.unique(part[part >= 0]):
        if hollowness(positions[part == hollow], normals[part == hollow]) > HOLLOW:
            continue
        outside = _around(int(hollow), part, positions, eye)
        part[part == hollow] = outside
    part = _floaters_joined(part, positions, lab)
    outlines = {k: _outline(positions[part == k]) for k in np.unique(part[part >= 0])}
    while pair := _intersecting(outlines, part, positions, normals):
        small, large = pair
        part[part == small] = large
        outlines[large] = _outline(positions[part == large])
        del outlines[small]
    return part


def insides_joined(part: np.ndarray, positions: np.ndarray, normals: np.ndarray, reach: float) -> np.ndarray:
    """Join neighbouring parts of the inside of one vessel, whose wall is one valley; return each voxel's part (V,).

    Args:
        part: (V,) the part of each voxel, -1 for none.
        positions: (V, 3) level frame, metres.
        normals: (V, 3) unit, toward the camera.
        reach: metres within which parts are neighbours.
    """
    part = part.copy()
    waiting = [
        k for k, size in zip(*np.unique(part[part >= 0], return_counts=True), strict=True)
        if size >= _PIECE and is_inside(part == k, positions, normals)
    ]  # fmt: skip
    while waiting:
        one = waiting.pop()
        own = part == one
        tree = cKDTree(positions[own])
        for other in waiting:
            its = part == other
            if tree.query(positions[its])[0].min() < reach and _hollow(own | its, positions, normals) < _HOLLOW_WHOLE:
                part[own] = other
                waiting.remove(other)
                waiting.append(other)  # it has grown: its neighbours are looked at again
                break
    return part


def is_inside(own: np.ndarray, positions: np.ndarray, normals: np.ndarray) -> bool:
    """Return whether a part is concave, and ends in an upright wall, not in a top.

    Args:
        own: (V,) its voxels.
        positions: (V, 3) level frame, metres.
        normals: (V, 3) unit, toward the camera.
    """
    if _hollow(own, positions, normals) > _CONCAVE:
        return False
    height = positions[own, 2]
    upper = height > np.percentile(height, 98) - _TOP_BAND
    return bool(np.median(normals[own, 2][upper]) < _UPRIGHT)


def _hollow(own: np.ndarray, positions: np.ndarray, normals: np.ndarray) -> float:
    return hollowness(positions[own], normals[own])


def _own_object(small: int, large: int, part: np.ndarray, positions: np.ndarray, normals: np.ndarray) -> bool:
    """Return whether a part in the place of a larger one is an object that stands on it, or in it."""
    own, other = positions[part == small], positions[part == large]
    if len(own) < _THING:
        return False
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


def hollowness(positions: np.ndarray, normals: np.ndarray) -> float:
    """Return how much the normals point away from the part's middle, seen from above: -1 to 1."""
    from_middle = positions[:, :2] - positions[:, :2].mean(axis=0)
    weight = np.linalg.norm(normals[:, :2], axis=1) * np.linalg.norm(from_middle, axis=1)
    return float((normals[:, :2] * from_middle).sum() / max(weight.sum(), 1e-9))


def _around(hollow: int, part: np.ndarray, positions: np.ndarray, eye: np.ndarray) -> int:
    """Return the part that encloses the hollow one: the nearest in front of it, as wide and as high; otherwise
    itself.
    """
    inside, others = positions[part == hollow], (part >= 0) & (part != hollow)
    if not others.any():
        return hollow
    away, _ = cKDTree(inside).query(positions[others])
    sight = inside[:, :2].mean(axis=0) - eye[:2]
    sight /= max(float(np.linalg.norm(sight)), 1e-9)
    across = np.array([-sight[1], sight[0]])
    best, least = hollow, _RIM
    for other in np.unique(part[others]):
        members = part[others] == other
        outside = positions[others][members]
        same_height = abs(outside[:, 2].max() - inside[:, 2].max()) < _RIM_HEIGHT
        in_front = (outside[:, :2] @ sight).mean() < (inside[:, :2] @ sight).mean()
        if same_height and in_front and _shared(outside[:, :2] @ across, inside[:, :2] @ across) > _AS_WIDE:
            if away[members].min() < least:
                best, least = int(other), float(away[members].min())
    return best


def _shared(one: np.ndarray, other: np.ndarray) -> float:
    """Return the share of the ranges of both that each has."""
    return (min(one.max(), other.max()) - max(one.min(), other.min())) / (
        max(one.max(), other.max()) - min(one.min(), other.min())
    )


def _intersecting(
    outlines: dict[int, shapely.Polygon], part: np.ndarray, positions: np.ndarray, normals: np.ndarray
) -> tuple[int, int] | None:
    """Return two parts of which the smaller, seen from above, lies in the larger and is no object of its own."""
    order = sorted(outlines, key=lambda k: outlines[k].area)
    for place, small in enumerate(order):
        for large in order[place + 1 :]:
            shared = outlines[small].intersection(outlines[large]).area
            if shared > _WITHIN * outlines[small].area and not _own_object(small, large, part, positions, normals):
                return small, large
    return None


def _outline(positions: np.ndarray) -> shapely.Polygon:
    return shapely.multipoints(positions[:, :2]).convex_hull.buffer(0.002)
