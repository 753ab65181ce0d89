"""Split connected parts into the objects that they consist of: at valleys, and at necks seen from above.

A piece between valleys is an object of its own only if it could be: it stands on the table, beside the others, or on
a surface of another that faces up. So a mug keeps its handle, a bottle its cap, and a stack falls into its parts.
"""

from __future__ import annotations

import numpy as np
import shapely
from scipy import ndimage
from scipy.spatial import cKDTree

from agent.perception.color import differ
from agent.perception.color_division import divided_by_color
from agent.perception.convexity import convex_pieces
from agent.perception.gap_closing import gaps_closed
from agent.perception.hollow_objects import hollow_objects_joined, hollowness

_HOLLOW = -0.3  # the normals of a solid seen from outside diverge (1 for a ball), those of an inside meet (-1)
LEAST = 80  # voxels of each object
_SHARE = 0.2  # of the other's voxels that the smaller has, at a neck
_LEAST_HEIGHT = 0.03  # m: lower things have no valleys that a camera sees
_REACHES_DOWN = 0.025  # m above the table
_ACROSS_VALLEY = 0.8  # of the reach within which voxels are neighbours
_FACES_UP = 0.7  # upward part of the normal of a surface that things stand on
_UPRIGHT = 0.5  # of a side that rises from it
_AT_FOOT, _SLOPING = 25, 0.01  # percent of a piece lie below where it stands at most, and m that noise adds
_BEYOND_EDGE = 0.022  # m from an edge: the normals are those of the surfaces on both sides of it
_CARRIES = 0.3  # of a piece's border lies on such a surface, and of the piece near it is such a side
_NARROWEST = 0.03  # m: what is less wide than that and stands on another is a part of it
_HIDDEN_SHARE = 0.25  # of the other's voxels has a piece of which another hides the foot
_RIM_HEIGHT = 0.02  # m between the upper ends of the inside and the outside of a vessel
_FOOTING = 0.5  # of its own width, as it is seen, is what it stands on at least
_BEHIND = 0.03  # m
_THIN_SHARE, _LOW_SHARE = 0.5, 0.3  # of the other's voxels has a piece too narrow or too low to stand beside it
_NARROW, _LOW = 0.024, 0.03  # m
_APART = 0.35  # of the smaller outline at most lies in the other: touching things only overlap by what was not seen
_CELL = 0.004  # m, seen from above
_NECK = 0.6  # of the smaller thing's half width at most is the neck's
_CONVEX = 0.9  # of each thing's hull it fills itself, seen from above; what has a neck fills less


def split(
    part: np.ndarray,
    positions: np.ndarray,
    normals: np.ndarray,
    lab: np.ndarray | None,
    eye: np.ndarray,
    reach: float,
) -> np.ndarray:
    """Split the parts that are several objects, and number all parts again.

    Args:
        part: (V,) the part of each voxel, -1 for none.
        positions: (V, 3) above the table, level frame, metres.
        normals: (V, 3) unit, toward the camera.
        lab: (V, 3) colours in CIELAB, or `None`.
        eye: (3,) where the camera is.
        reach: metres within which voxels are neighbours.
    """
    part = part.copy()
    for index in np.unique(part[part >= 0]):
        own = np.flatnonzero(part == index)
        if len(own) < 2 * LEAST or np.percentile(positions[own, 2], 90) < _LEAST_HEIGHT:
            part = _colors_apart(part, index, positions, lab, eye, reach)
            continue
        shades = None if lab is None else lab[own]
        pieces = convex_pieces(positions[own], normals[own], _ACROSS_VALLEY * reach, shades)
        pieces = hollow_objects_joined(pieces, positions[own], normals[own])
        pieces = _objects_among(pieces, positions[own], normals[own], shades, eye, reach)
        pieces = gaps_closed(pieces, positions[own], normals[own], shades, reach)
        for piece in range(1, pieces.max() + 1):
            part[own[pieces == piece]] = part.max() + 1
        for piece in range(pieces.max() + 1):
            members = own[pieces == piece]
            lobes = _by_necks(positions[members])
            if lobes.max() > 0 and _two_things(lobes == 1, positions[members], normals[members], eye):
                part[members[lobes == 1]] = part.max() + 1
        for piece in np.unique(part[own]):
            part = _colors_apart(part, piece, positions, lab, eye, reach)
    return part


def _colors_apart(
    part: np.ndarray, index: int, positions: np.ndarray, lab: np.ndarray | None, eye: np.ndarray, reach: float
) -> np.ndarray:
    """Divide a part, and what it falls into, where colour and shape show several objects."""
    part, waiting = part.copy(), [] if lab is None else [index]
    while waiting and lab is not None:
        members = np.flatnonzero(part == waiting.pop())
        second = divided_by_color(positions[members], lab[members], eye, reach)
        if second.any():
            waiting += [int(part[members[0]]), int(part.max()) + 1]
            part[members[second]] = waiting[-1]
    return part


def _objects_among(
    pieces: np.ndarray,
    positions: np.ndarray,
    normals: np.ndarray,
    lab: np.ndarray | None,
    eye: np.ndarray,
    reach: float,
) -> np.ndarray:
    """Merge the pieces (V,) that could not stand for themselves with the neighbours that they share most of their
    border with; return them numbered from 0.
    """
    one, other = cKDTree(positions).query_pairs(reach, output_type="ndarray").T
    pieces = pieces.copy()
    while True:
        across = pieces[one] != pieces[other]
        one, other = one[across], other[across]
        sizes = np.bincount(pieces)
        # A handle last: what it belongs to does not stand on it.
        for piece in sorted(np.flatnonzero(sizes), key=lambda k: (_is_thin(pieces == k, positions), sizes[k])):
            mine = (pieces[one] == piece) | (pieces[other] == piece)
            if not mine.any():  # too far from the others
                continue
            swapped = pieces[one[mine]] != piece
            inner = np.where(swapped, other[mine], one[mine])
            outer = np.where(swapped, one[mine], other[mine])
            if not _stands_alone(pieces == piece, inner, outer, pieces, positions, normals, lab, eye):
                border = np.bincount(pieces[outer])
                largest = max(np.flatnonzero(border), key=lambda k: (not _is_thin(pieces == k, positions), border[k]))
                pieces[pieces == piece] = largest
                break
        else:
            return np.unique(pieces, return_inverse=True)[1]


def _stands_alone(
    own: np.ndarray,
    inner: np.ndarray,
    outer: np.ndarray,
    pieces: np.ndarray,
    positions: np.ndarray,
    normals: np.ndarray,
    lab: np.ndarray | None,
    eye: np.ndarray,
) -> bool:
    """Return whether a piece could be an object.

    Args:
        own: (V,) its voxels.
        inner, outer: (B,) the voxels on both sides of its border, pair by pair.
        pieces: (V,) all pieces.
        positions, normals, lab, eye: as `split` takes them.
    """
    count = int(own.sum())
    if count < LEAST:
        return False
    mine = positions[own]
    neighbour = max(int((pieces == k).sum()) for k in np.unique(pieces[outer]))
    if _width(mine) < _NARROW and count < _THIN_SHARE * neighbour:
        return False
    if np.percentile(mine[:, 2], 95) < _LOW and count < _LOW_SHARE * neighbour:
        return False
    if np.percentile(mine[:, 2], 5) < _REACHES_DOWN:
        return True
    if _width(mine) > _NARROWEST and all(differ(lab, own, pieces == k) for k in np.unique(pieces[outer])):
        return True
    if _is_carried(own, np.unique(inner), np.isin(pieces, pieces[outer]), positions, normals, eye):
        return True
    front = pieces[outer[np.linalg.norm(positions[outer, :2] - eye[:2], axis=1).argmin()]]
    hider = positions[pieces == front]
    # What floats behind something and ends at the same height is its far side.
    apart = abs(np.percentile(mine[:, 2], 95) - np.percentile(hider[:, 2], 95)) > _RIM_HEIGHT
    return apart and count > _HIDDEN_SHARE * len(hider) and _is_behind(mine, hider, eye)


def _is_carried(
    own: np.ndarray,
    border: np.ndarray,
    others: np.ndarray,
    positions: np.ndarray,
    normals: np.ndarray,
    eye: np.ndarray,
) -> bool:
    """Return whether a piece rises from a surface that faces up and is as large as it needs to stand on it.

    Args:
        own: (V,) its voxels.
        border: (B,) those at its border with other pieces.
        others: (V,) the voxels of the other pieces there.
        positions, normals, eye: as `split` takes them.
    """
    mine = positions[own]
    if _width(mine) < _NARROWEST:
        return False
    tops = positions[others & (normals[:, 2] > _FACES_UP)]
    if not len(tops):
        return False
    # The normals at the edge itself are those of neither surface.
    away, nearest = cKDTree(tops).query(positions[border], distance_upper_bound=_BEYOND_EDGE)
    on_top = np.isfinite(away)
    on_top[on_top] = tops[nearest[on_top], 2] < positions[border[on_top], 2] + _CELL
    if on_top.mean() < _CARRIES:
        return False
    if _across(positions[border[on_top]], eye, mine) < _FOOTING * _across(mine, eye, mine):
        return False
    if np.median(positions[border[on_top], 2]) > np.percentile(mine[:, 2], _AT_FOOT) + _SLOPING:
        return False
    near = cKDTree(positions[border[on_top]]).query(mine, distance_upper_bound=_BEYOND_EDGE)[0] < _BEYOND_EDGE
    return bool((normals[own][near, 2] < _UPRIGHT).mean() > _CARRIES)


def _is_thin(own: np.ndarray, positions: np.ndarray) -> bool:
    return bool(own.sum() >= LEAST and _width(positions[own]) < _NARROW)


def _width(positions: np.ndarray) -> float:
    """Return the smaller side, metres, of the upright box around voxels (V, 3), seen from above."""
    corners = np.array(shapely.LineString(positions[:, :2]).minimum_rotated_rectangle.exterior.coords)
    return float(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1).min())


def _across(positions: np.ndarray, eye: np.ndarray, thing: np.ndarray) -> float:
    """Return the extent, metres, of voxels (V, 3) across the line of sight to an object (T, 3), seen from above."""
    sight = thing[:, :2].mean(axis=0) - eye[:2]
    beside = np.array([-sight[1], sight[0]]) / max(float(np.linalg.norm(sight)), 1e-9)
    low, high = np.percentile(positions[:, :2] @ beside, (2, 98))
    return float(high - low)


def _is_behind(thing: np.ndarray, other: np.ndarray, eye: np.ndarray) -> bool:
    """Return whether the foot of an object (V, 3) is clearly farther away than another object."""
    foot = thing[thing[:, 2] < np.percentile(thing[:, 2], 20)]
    away, its = (np.linalg.norm(points[:, :2] - eye[:2], axis=1).mean() for points in (other, foot))
    return bool(away + _BEHIND < its)


def _by_necks(positions: np.ndarray) -> np.ndarray:
    """Return the piece (V,) of each voxel: two pieces if, seen from above, a neck joins two convex shapes."""
    place = ((positions[:, :2] - positions[:, :2].min(axis=0)) / _CELL).astype(int) + 2
    seen = np.zeros(place.max(axis=0) + 3, dtype=bool)
    seen[place[:, 0], place[:, 1]] = True
    seen = ndimage.binary_fill_holes(ndimage.binary_closing(seen, iterations=2))
    pieces = np.zeros(len(positions), dtype=np.int64)
    if _solidity(seen) >= _CONVEX:
        return pieces
    inside = ndimage.distance_transform_edt(seen)
    for neck in np.arange(1.0, inside.max(), 1.0):
        lobes, count = ndimage.label(inside > neck)
        widths = ndimage.maximum(inside, lobes, np.arange(1, count + 1))
        wide = np.flatnonzero(widths * _NECK > neck) + 1
        if len(wide) == 2:
            _, nearest = ndimage.distance_transform_edt(~np.isin(lobes, wide), return_indices=True)
            lobe = lobes[nearest[0], nearest[1]]
            first = seen & (lobe == wide[0])
            if min(_solidity(first), _solidity(seen & ~first)) > _CONVEX:
                pieces[~first[place[:, 0], place[:, 1]]] = 1
            break
    return pieces


def _solidity(cells: np.ndarray) -> float:
    """Return the share of its convex hull that a set of cells fills."""
    rows, columns = np.nonzero(cells)
    corners = np.concatenate([np.column_stack((rows + a, columns + b)) for a in (0, 1) for b in (0, 1)])
    return len(rows) / shapely.LineString(corners).convex_hull.area if len(rows) else 0.0


def _two_things(one: np.ndarray, positions: np.ndarray, normals: np.ndarray, eye: np.ndarray) -> bool:
    """Return whether some of the voxels (V,) and the others are two objects that stand side by side."""
    small, large = sorted((int(one.sum()), int((~one).sum())))
    if small < max(LEAST, _SHARE * large):
        return False
    first, second = positions[one], positions[~one]
    for thing, other in ((first, second), (second, first)):
        if thing[:, 2].min() > _REACHES_DOWN and not _is_behind(thing, other, eye):
            return False
        if np.percentile(thing[:, 2], 90) < _LEAST_HEIGHT:
            return False
    if min(hollowness(positions[which], normals[which]) for which in (one, ~one)) < _HOLLOW:
        return False
    hulls = [shapely.LineString(thing[:, :2]).convex_hull for thing in (first, second)]
    return bool(hulls[0].intersection(hulls[1]).area < _APART * min(hull.area for hull in hulls))
