"""Convex parts of anything else: columns from the support up to what was seen, gathered into hulls."""

from __future__ import annotations

import heapq
import itertools
import math

import numpy as np
from scipy.spatial import ConvexHull, QhullError, cKDTree

from structdiffusion.objects.decomposition import few_vertices

_COLUMNS = 350  # over an object's outline, about
_CELL = (0.0025, 0.008)  # m, the side of a column
_THINNEST = 0.003  # m: what is flatter is taken to be so high
_MOST = 14  # parts
_OVERFILL = 0.06  # of the volume that hulls may hold beyond the columns
_SPARE = 1.5e-6  # m^3: less is not worth a part
_VERTICES = 48


def solid(points: np.ndarray, support: float) -> np.ndarray:
    """The vertices (V, 3) of the convex hull of points (P, 3) and of their shadows on z = `support`."""
    return _hull(_standing(points, support), support)[0]


def column_parts(points: np.ndarray, support: float) -> tuple[np.ndarray, ...]:
    """Convex parts (V, 3) of the body between the points (P, 3), seen from above, and z = `support`.

    Where one hull would hold much more than the columns below the points (an L, a ring, a step), it is cut in two, the
    worst part first.
    """
    cells, area = _cells(points, support)
    volume = float(cells[:, 2].sum() - support * len(cells)) * area
    vertices, overfill = _part(points, cells, area, support)
    waiting = [(-overfill, 0, points, cells, vertices)]
    numbers = itertools.count(1)
    done: list[np.ndarray] = []
    spare = max(_SPARE, 0.02 * volume)
    while waiting and len(waiting) + len(done) < _MOST:
        if -sum(entry[0] for entry in waiting) < _OVERFILL * volume:
            break
        worst, _, inside, columns, vertices = heapq.heappop(waiting)
        halves = _cut(inside, columns, area, support) if -worst > spare else None
        if halves is None or sum(half[3] for half in halves) > -worst - spare / 2:
            done.append(vertices)
            continue
        for points_of, columns_of, vertices_of, overfill in halves:
            heapq.heappush(waiting, (-overfill, next(numbers), points_of, columns_of, vertices_of))
    return tuple(done + [entry[4] for entry in sorted(waiting, key=lambda entry: entry[1])])


def _standing(points: np.ndarray, support: float) -> np.ndarray:
    """The points (P, 3), none flatter than the thinnest thing, with their shadows on the support."""
    points = np.array(points, dtype=np.float64)
    points[:, 2] = np.maximum(points[:, 2], support + _THINNEST)
    shadows = points.copy()
    shadows[:, 2] = support
    return np.concatenate((points, shadows))


def _hull(points: np.ndarray, support: float) -> tuple[np.ndarray, float]:
    """The vertices (V, 3) of a convex hull and its volume; of a small box where the points span none."""
    try:
        hull = ConvexHull(points)
        if hull.volume > 1e-9:
            return few_vertices(points[hull.vertices], _VERTICES), float(hull.volume)
    except (QhullError, ValueError):
        pass
    low, high = points.min(axis=0), points.max(axis=0)
    low[:2], high[:2] = low[:2] - 0.001, high[:2] + 0.001
    high[2] = max(high[2], support + _THINNEST)
    return np.array(list(itertools.product(*zip(low, high, strict=True)))), float(np.prod(high - low))


def _cells(points: np.ndarray, support: float) -> tuple[np.ndarray, float]:
    """Columns (C, 3): where each stands, and the height of its top; and the area of one, m^2."""
    flat = points[:, :2]
    try:
        area = float(ConvexHull(flat).volume)  # in 2-d, volume is area
    except (QhullError, ValueError):
        area = 1e-4
    side = float(np.clip(math.sqrt(area / _COLUMNS), *_CELL))
    tree = cKDTree(flat)
    spacing = float(np.median(tree.query(flat, k=min(5, len(flat)))[0][:, -1]))
    low = flat.min(axis=0)
    counts = np.ceil(np.ptp(flat, axis=0) / side).astype(int) + 1
    centers = np.stack(np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"), axis=-1).reshape(-1, 2) * side + low
    apart, near = tree.query(centers, k=min(3, len(flat)))
    there = apart[:, 0] < max(0.7 * side, 1.3 * spacing)
    tops = np.median(points[near[there], 2], axis=1)
    return np.column_stack((centers[there], np.maximum(tops, support + _THINNEST))), side * side


def _part(points: np.ndarray, cells: np.ndarray, area: float, support: float) -> tuple[np.ndarray, float]:
    """The hull (V, 3) over some points, and what it holds beyond the columns, m^3."""
    vertices, volume = _hull(_standing(points, support), support)
    return vertices, max(0.0, volume - float((cells[:, 2] - support).sum()) * area)


def _cut(
    points: np.ndarray, cells: np.ndarray, area: float, support: float
) -> list[tuple[np.ndarray, np.ndarray, np.ndarray, float]] | None:
    """The two parts, along the best of a few upright cuts, with what their hulls hold too much; `None` if too small."""
    best: list[tuple[np.ndarray, np.ndarray, np.ndarray, float]] | None = None
    least = math.inf
    middle = cells[:, :2].mean(axis=0)
    axes = np.linalg.svd(cells[:, :2] - middle, full_matrices=False)[2] if len(cells) > 2 else np.eye(2)
    seam = 0.3 * math.sqrt(area)
    for turn in (0.0, math.pi / 4, math.pi / 2, 3 * math.pi / 4):
        normal = math.cos(turn) * axes[0] + math.sin(turn) * axes[1]
        along, across = points[:, :2] @ normal, cells[:, :2] @ normal
        for share in (0.25, 0.5, 0.75):
            at = across.min() + share * np.ptp(across)
            halves = []
            for side in (1, -1):
                own, columns = points[side * (along - at) > -seam], cells[side * (across - at) > 0]
                if len(own) < 4 or len(columns) < 2:
                    break
                halves.append((own, columns, *_part(own, columns, area, support)))
            if len(halves) == 2 and (total := halves[0][3] + halves[1][3]) < least:
                best, least = halves, total
    return best
