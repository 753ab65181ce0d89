"""Divide pieces in two where colour and shape agree that they are two objects.

Neither is enough alone: a print has two colours on one shape, and a lid or a step has two widths in one colour. Two
objects that noise has joined differ in colour as wholes, and their outlines differ where the colours meet: what stands
on another is wider or narrower there, or stands back; what stands beside another makes a notch, seen from above.
"""

from __future__ import annotations

import numpy as np
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

_APART = 24.0  # of the medians of colours without shade at least
_OF_LIGHT, _TYPICAL, _DARKEST = 0.35, 55.0, 20.0  # what lightness counts; usual lightness, and where hues end in noise
_OWN_COLOR = 0.85  # of each half is nearer to its own median than to the other's
_CONNECTED = 0.8  # of each half is one connected part
_LEAST, _SHARE = 60, 0.12  # voxels, and of the piece, of each half
_ROUNDS = 8
_AROUND = 0.012  # m over which colours are averaged: a print's details are no halves
_ABOVE = 0.012  # m by which a lower half may reach above the lower end of an upper one
_HIGH = 0.02  # m that each half of a stack is high, less is a lid or a rim, but for a plate below
_WIDER = 0.012  # m that a plate reaches farther to one side than what stands on it
_WIDE = 0.03  # m that it is wide, less is a cap
_BAND = 0.025  # m above and below the seam, in which outlines are compared
_STEP = 0.005  # m by which they differ
_NOTCH = 0.012  # m by which the border lies behind the line between the halves' middles
_OVERLAP = 0.3  # of the smaller hull lies in the other at most
_DOWN = 0.4  # of its height above the table, up to where what stands beside another reaches


def divided_by_color(positions: np.ndarray, lab: np.ndarray, eye: np.ndarray, reach: float) -> np.ndarray:
    """Return which voxels (V,) of a piece are a second object; none if it is one.

    Args:
        positions: (V, 3) above the table, level frame, metres.
        lab: (V, 3) colours in CIELAB.
        eye: (3,) where the camera is.
        reach: metres within which voxels are neighbours.
    """
    nothing = np.zeros(len(positions), dtype=bool)
    if len(positions) < 2 * _LEAST:
        return nothing
    pairs = cKDTree(positions).query_pairs(reach, output_type="ndarray")
    lab = shadeless(lab)
    half = _halves(positions, lab)
    if half is None:
        return nothing
    half = _cleaned(half, pairs)
    sizes = sorted((int(half.sum()), int((~half).sum())))
    if sizes[0] < max(_LEAST, _SHARE * len(half)) or not _differ(half, lab):
        return nothing
    if _is_stack(half, positions, eye) or _is_stack(~half, positions, eye) or _are_beside(half, positions, eye, reach):
        return half
    return nothing


def shadeless(lab: np.ndarray) -> np.ndarray:
    """Return colours (V, 3) in which light and shade of one colour are near each other:
    shade lowers all values alike.
    """
    light = lab[:, :1]
    return np.hstack((_OF_LIGHT * light, _TYPICAL * lab[:, 1:] / np.maximum(light, _DARKEST)))


def _halves(positions: np.ndarray, lab: np.ndarray) -> np.ndarray | None:
    """Divide voxels by two means of their colours around (V,); `None` where one is empty."""
    tree = cKDTree(positions)
    _, near = tree.query(positions, k=min(12, len(positions)), distance_upper_bound=_AROUND)
    padded = np.vstack((lab, np.full(3, np.nan)))
    shades = np.nanmedian(padded[near], axis=1)
    spread = shades - shades.mean(axis=0)
    axis = np.linalg.svd(spread, full_matrices=False)[2][0]
    half = spread @ axis > 0
    for _ in range(_ROUNDS):
        if not half.any() or half.all():
            return None
        means = np.median(shades[half], axis=0), np.median(shades[~half], axis=0)
        away = [np.linalg.norm(shades - mean, axis=1) for mean in means]
        half = away[0] < away[1]
    return half if half.any() and not half.all() else None


def _cleaned(half: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Give islands of one half within the other to that."""
    half = half.copy()
    for side in (True, False):
        inside = (half[pairs] == side).all(axis=1)
        graph = coo_matrix((np.ones(inside.sum()), pairs[inside].T), shape=(len(half), len(half)))
        _, component = connected_components(graph, directed=False)
        own = np.flatnonzero(half == side)
        if not len(own):
            return half
        sizes = np.bincount(component[own])
        small = sizes[component[own]] < (1.0 - _CONNECTED) * len(own)
        half[own[small]] = not side
    return half


def _differ(half: np.ndarray, lab: np.ndarray) -> bool:
    """Return whether the halves differ in colour as wholes."""
    medians = np.median(lab[half], axis=0), np.median(lab[~half], axis=0)
    if np.linalg.norm(medians[0] - medians[1]) < _APART:
        return False
    nearer = np.linalg.norm(lab - medians[0], axis=1) < np.linalg.norm(lab - medians[1], axis=1)
    return bool(nearer[half].mean() > _OWN_COLOR and (~nearer[~half]).mean() > _OWN_COLOR)


def _is_stack(upper: np.ndarray, positions: np.ndarray, eye: np.ndarray) -> bool:
    """Return whether one half stands on the other: it lies above it, and their outlines differ at the seam."""
    above, below = positions[upper], positions[~upper]
    seam = float((np.percentile(above[:, 2], 3) + np.percentile(below[:, 2], 97)) / 2)
    if np.percentile(below[:, 2], 95) > np.percentile(above[:, 2], 5) + _ABOVE:
        return False
    if np.ptp(above[:, 2]) < _HIGH:
        return False
    bands = [part[np.abs(part[:, 2] - seam) < _BAND] for part in (above, below)]
    if min(map(len, bands)) < _LEAST // 4:
        return False
    sight = positions[:, :2].mean(axis=0) - eye[:2]
    sight /= np.linalg.norm(sight)
    beside = np.array([-sight[1], sight[0]])
    across = [np.percentile(band[:, :2] @ beside, (3, 97)) for band in bands]
    front = [np.percentile(band[:, :2] @ sight, 10) for band in bands]
    if min(float(np.ptp(ends)) for ends in across) < _WIDE:
        return False
    if seam < _HIGH and max(across[0][0] - across[1][0], across[1][1] - across[0][1]) < _WIDER:
        return False
    return bool(max(np.abs(across[0] - across[1]).max(), abs(front[0] - front[1])) > _STEP)


def _are_beside(half: np.ndarray, positions: np.ndarray, eye: np.ndarray, reach: float) -> bool:
    """Return whether the halves stand beside each other, with a notch between them, seen from above."""
    parts = positions[half], positions[~half]
    if any(np.percentile(part[:, 2], 3) > _DOWN * np.percentile(part[:, 2], 97) for part in parts):
        return False
    hulls = [shapely.multipoints(part[:, :2]).convex_hull for part in parts]
    if any(_width(hull) < _WIDE and part[:, 2].max() > _WIDE for hull, part in zip(hulls, parts, strict=True)):
        return False  # a handle; cutlery is as narrow, and lower
    shared = hulls[0].intersection(hulls[1]).area
    if shared > _OVERLAP * min(hull.area for hull in hulls):
        return False
    # The front of one thing bulges toward the camera where two of its colours meet; between two things it draws back.
    middles = [part[:, :2].mean(axis=0) for part in parts]
    trees = [cKDTree(part) for part in parts]
    border = np.vstack([
        parts[k][np.isfinite(trees[1 - k].query(parts[k], distance_upper_bound=reach)[0]), :2] for k in (0, 1)
    ])  # fmt: skip
    if not len(border):
        return True
    along = middles[1] - middles[0]
    back = np.array([-along[1], along[0]]) / max(float(np.linalg.norm(along)), 1e-9)
    back *= np.sign(back @ (middles[0] + middles[1] - 2 * eye[:2]))
    return bool(np.median((border - middles[0]) @ back) > _NOTCH)


def _width(hull: shapely.Geometry) -> float:
    """Return the smaller side, metres, of the box around an outline."""
    around = hull.minimum_rotated_rectangle
    if around.geom_type != "Polygon":
        return 0.0
    corners = np.array(around.exterior.coords)
    return float(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1).min())
