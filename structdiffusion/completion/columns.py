"""Convex parts of objects without symmetry: columns from the support up to the seen points, merged into hulls."""

from __future__ import annotations

import heapq
import itertools
import math

import numpy as np
from scipy.spatial import ConvexHull, QhullError, cKDTree

from structdiffusion.completion.view import EDGE
from structdiffusion.objects.decomposition import few_vertices

_COLUMNS = 350  # approximate number over an object's outline
_CELL = (0.0025, 0.008)  # m, the side of a column
_THINNEST = 0.003  # m: flatter objects are given this height
_MOST = 14  # largest number of parts
_OVERFILL = 0.06  # share of the volume by which hulls may exceed the columns
_SPARE = 1.5e-6  # m^3: a smaller excess does not justify another part
_FEWEST = 6  # points needed for an outline
_SMALLEST = 1e-9  # m^3
_VERTICES = 48


def solid(points: np.ndarray, support: float) -> np.ndarray:
    """Return the vertices (V, 3) of the hull of points (P, 3), widened by the pixel loss,
    and of their shadows below.
    """
    points = _standing(points, support)
    outward = points[:, :2] - 0.5 * (points[:, :2].min(axis=0) + points[:, :2].max(axis=0))
    points[:, :2] += EDGE * outward / np.maximum(np.linalg.norm(outward, axis=1), 1e-6)[:, None]
    try:
        hull = ConvexHull(points)
        if hull.volume > _SMALLEST:
            return few_vertices(points[hull.vertices], _VERTICES)
    except (QhullError, ValueError):
        pass  # too few points, or all on one line: a small box around them
    low, high = points.min(axis=0), points.max(axis=0)
    low[:2], high[:2] = low[:2] - _THINNEST / 2, high[:2] + _THINNEST / 2
    return np.array(list(itertools.product(*zip(low, high, strict=True))))


def column_parts(points: np.ndarray, support: float) -> tuple[np.ndarray, ...]:
    """Return convex parts (V, 3) of the body between the points (P, 3), seen from above, and z = `support`.

    A hull that contains much more than the columns below the points (an L, a ring, a step) is cut in two, the worst
    part first.
    """
    if len(points) < _FEWEST:
        return (solid(points, support),)
    cells, area = _cells(points, support)
    volume = float((cells[:, 2] - support).sum()) * area
    spare = max(_SPARE, 0.02 * volume)
    numbers = itertools.count()
    waiting = [(-_overfill(points, cells, area, support), next(numbers), points, cells)]
    done: list[np.ndarray] = []
    while waiting and len(waiting) + len(done) < _MOST:
        if -sum(entry[0] for entry in waiting) < _OVERFILL * volume:
            break
        worst, _, own, columns = heapq.heappop(waiting)
        halves = _cut(own, columns, area, support) if -worst > spare else []
        if not halves or sum(overfill for overfill, _, _ in halves) > -worst - spare / 2:
            done.append(own)
            continue
        for overfill, own, columns in halves:
            heapq.heappush(waiting, (-overfill, next(numbers), own, columns))
    return tuple(solid(own, support) for own in (*done, *(entry[2] for entry in waiting)))


def _standing(points: np.ndarray, support: float) -> np.ndarray:
    """Return the points (P, 3), raised to at least the smallest height, with their shadows on the support."""
    points = np.array(points, dtype=np.float64)
    points[:, 2] = np.maximum(points[:, 2], support + _THINNEST)
    shadows = points.copy()
    shadows[:, 2] = support
    return np.concatenate((points, shadows))


def _cells(points: np.ndarray, support: float) -> tuple[np.ndarray, float]:
    """Return columns (C, 3), each with its position and the height of its top, and the area of one, m^2."""
    flat = points[:, :2]
    try:
        area = float(ConvexHull(flat).volume)  # in 2-d, volume is area
    except (QhullError, ValueError):
        area = 1e-4
    side = float(np.clip(math.sqrt(area / _COLUMNS), *_CELL))
    tree = cKDTree(flat)
    spacing = float(np.median(tree.query(flat, k=5)[0][:, -1]))
    low = flat.min(axis=0)
    counts = np.ceil(np.ptp(flat, axis=0) / side).astype(int) + 1
    centers = np.stack(np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"), axis=-1).reshape(-1, 2) * side + low
    apart, near = tree.query(centers, k=3)
    there = apart[:, 0] < max(0.7 * side, 1.3 * spacing)
    tops = np.median(points[near[there], 2], axis=1)
    return np.column_stack((centers[there], np.maximum(tops, support + _THINNEST))), side * side


def _overfill(points: np.ndarray, cells: np.ndarray, area: float, support: float) -> float:
    """Return the volume by which the hull over some points exceeds the columns, m^3."""
    try:
        outermost = ConvexHull(points[:, :2]).vertices  # the shadows of all other points lie between theirs
        standing = _standing(points, support)
        volume = float(ConvexHull(standing[np.concatenate((np.arange(len(points)), len(points) + outermost))]).volume)
    except (QhullError, ValueError):
        return 0.0
    return max(0.0, volume - float((cells[:, 2] - support).sum()) * area)


def _cut(
    points: np.ndarray, cells: np.ndarray, area: float, support: float
) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Return the halves of the best of a few upright cuts: excess volume of the hull, points and columns of each."""
    best: list[tuple[float, np.ndarray, np.ndarray]] = []
    least = math.inf
    if len(cells) < 4:
        return best
    axes = np.linalg.svd(cells[:, :2] - cells[:, :2].mean(axis=0), full_matrices=False)[2]
    seam = 0.3 * math.sqrt(area)  # the hulls of neighbours meet at the seam
    for turn in (0.0, math.pi / 4, math.pi / 2, 3 * math.pi / 4):
        normal = math.cos(turn) * axes[0] + math.sin(turn) * axes[1]
        along, across = points[:, :2] @ normal, cells[:, :2] @ normal
        for share in (0.25, 0.5, 0.75):
            at = across.min() + share * np.ptp(across)
            halves = []
            for side in (1, -1):
                own, columns = points[side * (along - at) > -seam], cells[side * (across - at) > 0]
                if len(own) >= 4 and len(columns) >= 2:
                    halves.append((_overfill(own, columns, area, support), own, columns))
            if len(halves) == 2 and (total := halves[0][0] + halves[1][0]) < least:
                best, least = halves, total
    return best
