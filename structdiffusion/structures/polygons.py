"""Fit rectangles and triangles to the centroids of objects, and measure places along their outlines.

The corner objects belong to both sides that meet there, every other object to the nearest side; the outline is the one
of least squares of the distances to these sides. Fits start from several outlines, because the assignment has local
optima.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np

from structdiffusion.evaluation_protocol import MAX_OFF_CORNER, MAX_OFF_OUTLINE, MAX_OUTLINE_GAP_RATIO
from structdiffusion.structures.checks import Check

# Points (N, 2) and the members of each side -> corners (C, 2).
_Fit = Callable[[np.ndarray, Sequence[Sequence[int]]], np.ndarray]
EVEN_OUTLINE = 0.95 * MAX_OUTLINE_GAP_RATIO  # to which layouts keep
_ROUNDS = 6  # of assigning objects to sides and fitting the sides to them
_REFINED = 4  # starts that are refined, those of least cost
_DIRECTIONS = 12  # of rectangles to start from, within a quarter turn, besides those of pairs of objects


def outline_checks(points: np.ndarray, corners: np.ndarray) -> list[Check]:
    """Check that centroids (N, 2) lie on an outline with corners (C, 2): near it, at every corner, evenly along it."""
    off, along = project(points, corners)
    worst = float(off.max())
    missed = float(corner_distances(points, corners).max())
    perimeter = float(side_lengths(corners).sum())
    gaps = np.diff(np.append(np.sort(along), along.min() + perimeter))
    ratio = float(gaps.max() / max(gaps.mean(), 1e-9))
    return [
        Check("distance to the outline (m)", worst <= MAX_OFF_OUTLINE, worst, f"<= {MAX_OFF_OUTLINE:.3f}"),
        Check("corner to its object (m)", missed <= MAX_OFF_CORNER, missed, f"<= {MAX_OFF_CORNER:.3f}"),
        Check(
            "largest gap along the outline / mean gap",
            ratio <= MAX_OUTLINE_GAP_RATIO,
            ratio,
            f"<= {MAX_OUTLINE_GAP_RATIO:g}",
        ),
    ]


def side_lengths(corners: np.ndarray) -> np.ndarray:
    """Return the lengths (C,) of the sides of a polygon (C, 2); side k runs from corner k to the next."""
    return np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)


def inner_angles(corners: np.ndarray) -> np.ndarray:
    """Return the inner angles (C,), degrees, of a convex polygon (C, 2)."""
    ahead, back = np.roll(corners, -1, axis=0) - corners, np.roll(corners, 1, axis=0) - corners
    norms = np.linalg.norm(ahead, axis=1) * np.linalg.norm(back, axis=1)
    return np.degrees(np.arccos(np.clip((ahead * back).sum(axis=1) / np.maximum(norms, 1e-12), -1, 1)))


def project(points: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how far points (N, 2) are from a polygon's outline, (N,), and where along it they are, (N,), metres."""
    distances, shares, lengths = _to_sides(points, corners)
    side = distances.argmin(axis=1)
    rows = np.arange(len(points))
    starts = np.concatenate(([0.0], np.cumsum(lengths)[:-1]))
    return distances[rows, side], starts[side] + shares[rows, side] * lengths[side]


def _to_sides(points: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return distances (N, C) to the sides, where along each side (N, C) from 0 to 1, and the sides' lengths (C,)."""
    edges = np.roll(corners, -1, axis=0) - corners
    lengths = np.maximum(np.linalg.norm(edges, axis=1), 1e-9)
    offsets = points[:, None] - corners
    shares = np.clip((offsets * edges).sum(axis=2) / lengths**2, 0.0, 1.0)
    return np.linalg.norm(offsets - shares[:, :, None] * edges, axis=2), shares, lengths


def corner_distances(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return how far (C,) each corner is from its object, no object serving two corners: the best assignment."""
    distances = np.linalg.norm(points[:, None] - corners, axis=2)
    return distances[list(corner_objects(points, corners)), range(len(corners))]


def corner_objects(points: np.ndarray, corners: np.ndarray) -> tuple[int, ...]:
    """Return which point (N, 2) stands at each corner (C, 2), each at one: by the least sum of squared distances."""
    from scipy.optimize import linear_sum_assignment  # takes longer to import than all structures

    squares = ((corners[:, None] - points) ** 2).sum(axis=2)
    return tuple(linear_sum_assignment(squares)[1])


def fit_rectangle(points: np.ndarray) -> np.ndarray:
    """Return the corners (4, 2), counter-clockwise, of the least-squares rectangle of points (N, 2), N >= 4."""
    one, other = np.triu_indices(len(points), 1)
    pairs = points[one] - points[other]
    headings = np.arctan2(pairs[:, 1], pairs[:, 0])
    headings = np.concatenate((headings, np.arange(_DIRECTIONS) * np.pi / (2 * _DIRECTIONS)))
    starts = [_box(points, heading) for heading in headings]
    return _best_fit(points, starts, _rectangle_of)


def fit_triangle(points: np.ndarray) -> np.ndarray:
    """Return the corners (3, 2), counter-clockwise, of the least-squares triangle of points (N, 2), N >= 3."""
    starts = []
    for triple in itertools.combinations(range(len(points)), 3):
        corners = points[list(triple)]
        area = np.linalg.det(corners[1:] - corners[0])
        if abs(area) > 1e-9:
            starts.append(corners if area > 0 else corners[::-1])
    return _best_fit(points, starts or [points[:3]], _triangle_of)


def _cost(points: np.ndarray, corners: np.ndarray) -> float:
    off, _ = project(points, corners)
    return float((off**2).sum() + (corner_distances(points, corners) ** 2).sum())


def _best_fit(points: np.ndarray, starts: Sequence[np.ndarray], fit: _Fit) -> np.ndarray:
    """Return the outline of least cost among the starts and their refinements, in which sides are fitted to their
    objects.
    """
    costs = [_cost(points, start) for start in starts]
    best = min(zip(costs, starts), key=lambda pair: pair[0])
    for number in np.argsort(costs, kind="stable")[:_REFINED]:
        corners = starts[number]
        for _ in range(_ROUNDS):
            corners = fit(points, _members(points, corners))
            cost = _cost(points, corners) if np.isfinite(corners).all() else np.inf
            if cost >= best[0] - 1e-15:
                break
            best = (cost, corners)
    return best[1]


def _members(points: np.ndarray, corners: np.ndarray) -> list[list[int]]:
    """Return which points belong to each side: those at its corners, and those nearer to it than to other sides."""
    at_corner = corner_objects(points, corners)
    nearest = _to_sides(points, corners)[0].argmin(axis=1)
    return [
        [at_corner[side], at_corner[(side + 1) % len(corners)]]
        + [i for i in range(len(points)) if i not in at_corner and nearest[i] == side]
        for side in range(len(corners))
    ]


def _box(points: np.ndarray, heading: float) -> np.ndarray:
    """Return the corners (4, 2) of the box about points (N, 2) whose sides run along and across a heading (rad)."""
    axes = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    low, high = (points @ axes.T).min(axis=0), (points @ axes.T).max(axis=0)
    return np.array([low, (high[0], low[1]), high, (low[0], high[1])]) @ axes


def _rectangle_of(points: np.ndarray, sides: Sequence[Sequence[int]]) -> np.ndarray:
    """Return the rectangle of least squares of the distances of points to the sides that they belong to.

    All sides share one direction up to quarter turns: it is the axis of least spread of all sides' points about the
        sides'
    means, those of every second side turned by a quarter.
    """
    spread = np.zeros((2, 2))
    for number, side in enumerate(sides):
        own = points[list(side)] - points[list(side)].mean(axis=0)
        own = own @ np.array([[0.0, -1.0], [1.0, 0.0]]) if number % 2 else own
        spread += own.T @ own
    normal = np.linalg.eigh(spread)[1][:, 0]  # across sides 0 and 2
    along = np.array([-normal[1], normal[0]])
    offsets = [
        float((points[list(side)] @ (along if number % 2 else normal)).mean()) for number, side in enumerate(sides)
    ]
    corners = np.array([offsets[k] * normal + offsets[m] * along for k, m in ((0, 3), (0, 1), (2, 1), (2, 3))])
    return corners if np.linalg.det(corners[1:3] - corners[0]) > 0 else corners[::-1]


def _triangle_of(points: np.ndarray, sides: Sequence[Sequence[int]]) -> np.ndarray:
    """Return the triangle whose sides are the least-squares lines of the points that belong to them."""
    lines = []
    for side in sides:
        middle = points[list(side)].mean(axis=0)
        direction = np.linalg.svd(points[list(side)] - middle)[2][0]
        normal = np.array([-direction[1], direction[0]])
        lines.append((normal, float(normal @ middle)))
    corners = []
    for before, after in ((2, 0), (0, 1), (1, 2)):
        system = np.array([lines[before][0], lines[after][0]])
        if abs(np.linalg.det(system)) < 1e-6:
            return np.full((3, 2), np.inf)
        corners.append(np.linalg.solve(system, [lines[before][1], lines[after][1]]))
    result = np.array(corners)
    return result if np.linalg.det(result[1:] - result[0]) > 0 else result[::-1]


def places_on(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the corners for the points (N, 2) that belong there, and even places on each side for its other points."""
    at_corner = corner_objects(points, corners)
    places = np.array(points)
    places[list(at_corner)] = corners
    for number, side in enumerate(_members(points, corners)):
        start, end = corners[number], corners[(number + 1) % len(corners)]
        inner = sorted(side[2:], key=lambda i: float((points[i] - start) @ (end - start)))
        for k, i in enumerate(inner, start=1):
            places[i] = start + (end - start) * k / (len(inner) + 1)
    return places


def order_along(points: np.ndarray, corners: np.ndarray) -> list[int]:
    """Return the points (N, 2) by index as they follow one another along an outline (C, 2), counter-clockwise."""
    return [int(i) for i in np.argsort(project(points, corners)[1])]


def pairs_around(sequence: Sequence[int]) -> list[tuple[int, int]]:
    """Return each index and the next one, and the last with the first."""
    return list(zip(sequence, [*sequence[1:], sequence[0]]))
