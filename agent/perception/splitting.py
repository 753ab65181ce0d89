"""Split objects that touch: parts with a valley or a neck between them.

A cut is kept only between objects that could each stand alone: both reach the table as far as it is seen, both
are large, and neither stands in the other's place. So a mug keeps its handle, a bottle its cap, and a bowl its inside.
"""

from __future__ import annotations

import numpy as np
import shapely
from scipy import ndimage
from scipy.spatial import cKDTree

from agent.perception.clustering import clusters
from agent.perception.merging import HOLLOW, hollowness

_LEAST = 100  # voxels of each thing
_SHARE = 0.2  # of the other's voxels that the smaller has
_LEAST_HEIGHT = 0.03  # m: lower things have no valleys that a camera sees
_REACHES_DOWN = 0.025  # m above the table
_NEAR, _FAR = 0.010, 0.020  # m between the voxels whose normals are compared: about the patch of a normal
_VALLEY = 0.6  # the normals' slopes toward each other, together: each side rises by 17 degrees or more
_MOST_OF = 0.3  # of a voxel's neighbours lie across the valley that it lies in
_APART = 0.35  # of the smaller outline at most lies in the other: touching things only overlap by what was not seen
_CELL = 0.004  # m, seen from above
_NECK = 0.6  # of the smaller thing's half width at most is the neck's
_CONVEX = 0.9  # of each thing's hull it fills itself, seen from above; what has a neck fills less


def split(part: np.ndarray, positions: np.ndarray, normals: np.ndarray, eye: np.ndarray, reach: float) -> np.ndarray:
    """Split the parts that are several objects, and number all parts again.

    Args:
        part: (V,) the part of each voxel, -1 for none.
        positions: (V, 3) above the table, level frame, metres.
        normals: (V, 3) unit, toward the camera.
        eye: (3,) where the camera is.
        reach: metres within which voxels are neighbours.
    """
    part = part.copy()
    waiting = [int(index) for index in np.unique(part[part >= 0])]
    while waiting:
        own = np.flatnonzero(part == waiting.pop())
        if len(own) < 2 * _LEAST or np.percentile(positions[own, 2], 90) < _LEAST_HEIGHT:
            continue
        for pieces in (_by_valleys(positions[own], normals[own], reach), _by_necks(positions[own])):
            if pieces.max() > 0 and (two := _two_things(pieces, positions[own], normals[own], eye)) is not None:
                part[own[two]] = part.max() + 1
                waiting += [int(part.max()), int(part[own[~two]][0])]
                break
    return part


def _by_valleys(positions: np.ndarray, normals: np.ndarray, reach: float) -> np.ndarray:
    """Return the piece (V,) of each voxel: the parts that stay connected without the voxels in valleys."""
    tree = cKDTree(positions)
    one, other = tree.query_pairs(_FAR, output_type="ndarray").T
    offset = positions[other] - positions[one]
    length = np.linalg.norm(offset, axis=1)
    far = length > _NEAR
    one, other, offset, length = one[far], other[far], offset[far], length[far]
    across = ((normals[one] - normals[other]) * offset).sum(axis=1) / length > _VALLEY
    count = np.bincount(one, minlength=len(positions)) + np.bincount(other, minlength=len(positions))
    crossed = np.bincount(one[across], minlength=len(positions)) + np.bincount(other[across], minlength=len(positions))
    ridge = crossed <= _MOST_OF * count
    pieces = np.full(len(positions), -1)
    if ridge.any():
        pieces[ridge] = clusters(positions[ridge], 0.7 * reach)
    return _spread(pieces, positions)


def _by_necks(positions: np.ndarray) -> np.ndarray:
    """Return the piece (V,) of each voxel: two pieces if, seen from above, a neck joins two convex shapes."""
    place = ((positions[:, :2] - positions[:, :2].min(axis=0)) / _CELL).astype(int) + 2
    seen = np.zeros(place.max(axis=0) + 3, dtype=bool)
    seen[place[:, 0], place[:, 1]] = True
    seen = ndimage.binary_fill_holes(ndimage.binary_closing(seen, iterations=2))
    pieces = np.zeros(len(positions), dtype=np.int64)
    inside = ndimage.distance_transform_edt(seen)
    for neck in np.arange(1.0, inside.max(), 1.0):
        lobes, count = ndimage.label(inside > neck)
        widths = ndimage.maximum(inside, lobes, np.arange(1, count + 1))
        wide = np.flatnonzero(widths * _NECK > neck) + 1
        if len(wide) == 2:
            _, nearest = ndimage.distance_transform_edt(~np.isin(lobes, wide), return_indices=True)
            lobe = lobes[nearest[0], nearest[1]]
            first = seen & (lobe == wide[0])
            if _solidity(seen) < _CONVEX and min(_solidity(first), _solidity(seen & ~first)) > _CONVEX:
                pieces[~first[place[:, 0], place[:, 1]]] = 1
            break
    return pieces


def _solidity(cells: np.ndarray) -> float:
    """Return the share of its convex hull that a set of cells fills."""
    rows, columns = np.nonzero(cells)
    corners = np.concatenate([np.column_stack((rows + a, columns + b)) for a in (0, 1) for b in (0, 1)])
    return len(rows) / shapely.LineString(corners).convex_hull.area if len(rows) else 0.0


def _spread(pieces: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Keep the pieces with enough voxels and assign every other voxel to the nearest of them; one piece if none has
    enough.
    """
    sizes = np.bincount(pieces[pieces >= 0], minlength=1)
    large = np.flatnonzero(sizes >= _LEAST / 2)
    if len(large) < 2:
        return np.zeros(len(pieces), dtype=np.int64)
    known = np.isin(pieces, large)
    _, nearest = cKDTree(positions[known]).query(positions)
    return np.searchsorted(large, pieces[known][nearest])


def _stands(thing: np.ndarray, other: np.ndarray, eye: np.ndarray) -> bool:
    """Return whether an object (V, 3) reaches the table, or the other hides the place where it would."""
    if thing[:, 2].min() < _REACHES_DOWN:
        return True
    foot = thing[thing[:, 2] < np.percentile(thing[:, 2], 20)]
    away, its = (np.linalg.norm(points[:, :2] - eye[:2], axis=1).mean() for points in (other, foot))
    return bool(away < its)


def _two_things(
    pieces: np.ndarray, positions: np.ndarray, normals: np.ndarray, eye: np.ndarray
) -> np.ndarray | None:
    """Return the voxels (V,) of one object among the pieces that stands beside all the others; `None` if none does."""
    for index in np.argsort(np.bincount(pieces))[::-1]:
        one = pieces == index
        small, large = sorted((one.sum(), (~one).sum()))
        if small < max(_LEAST, _SHARE * large):
            continue
        if not (_stands(positions[one], positions[~one], eye) and _stands(positions[~one], positions[one], eye)):
            continue
        if min(np.percentile(positions[one, 2], 90), np.percentile(positions[~one, 2], 90)) < _LEAST_HEIGHT:
            continue
        if min(hollowness(positions[which], normals[which]) for which in (one, ~one)) < HOLLOW:
            continue
        hulls = [shapely.LineString(positions[which, :2]).convex_hull for which in (one, ~one)]
        if hulls[0].intersection(hulls[1]).area < _APART * min(hull.area for hull in hulls):
            return one
    return None
