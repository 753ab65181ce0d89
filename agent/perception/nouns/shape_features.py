"""Measure the shape of a partly seen object in numbers that tell mugs, bowls, bottles and boxes apart."""

from __future__ import annotations

import numpy as np
import shapely

_MOST = 3000  # points that are measured
_LEVELS = ((0.05, 0.22), (0.25, 0.42), (0.45, 0.62), (0.65, 0.82), (0.86, 1.02))  # of the height: bands of a silhouette
_COLUMNS = 7  # of the front
_INNER = 0.5  # of the radius at the top: what lies nearer to the axis is the middle
_LEAST = 0.004  # m: sizes are not taken for smaller
COUNT = 26


def shape_features(points: np.ndarray, eye: np.ndarray, bottom: float = 0.0) -> np.ndarray:
    """Return the numbers (26,) float32 that describe an object's shape, independent of its place and heading.

    Args:
        points: (P, 3) of its visible side, world frame, z up, metres; at least 1.
        eye: (3,) position of the camera.
        bottom: z of what it stands on.
    """
    points = points[:: max(1, len(points) // _MOST)].astype(np.float64)
    middle = (points.min(axis=0) + points.max(axis=0))[:2] / 2
    away = middle - eye[:2]
    away = away / max(float(np.linalg.norm(away)), 1e-6)
    across = np.array([-away[1], away[0]])
    flat = points[:, :2] - middle
    seen = np.column_stack((flat @ away, flat @ across, points[:, 2] - bottom))
    height = max(float(np.percentile(seen[:, 2], 99)), _LEAST)
    rise = seen[:, 2] / height
    low, high = np.percentile(seen[:, 1], (1, 99))
    width = max(float(high - low), _LEAST)
    depth = max(float(np.ptp(np.percentile(seen[:, 0], (1, 99)))), _LEAST)
    view = float(np.arctan2(eye[2] - bottom - height / 2, np.linalg.norm(middle - eye[:2])))
    numbers = [np.log(height / 0.1), np.log(width / 0.1), np.log(depth / 0.1), np.sin(view)]
    numbers += _silhouette(seen, rise, width)
    numbers += _hollow(seen, rise, width)
    numbers += _front(seen, rise, width)
    numbers += [_fill(seen[:, :2]), _fill(seen[rise > 0.8, :2])]
    sides = _sides(seen[:, :2])
    numbers += [np.log(sides[0] / sides[1]), np.log(sides[0] / 0.1)]
    return np.clip(np.array(numbers, dtype=np.float32), -4.0, 4.0)


def _silhouette(seen: np.ndarray, rise: np.ndarray, width: float) -> list[float]:
    """Return the widths of the bands of the silhouette, as shares of the widest, and how lopsided the middle is."""
    widths = []
    for low, high in _LEVELS:
        band = seen[(rise >= low) & (rise < high), 1]
        widths.append(float(np.ptp(np.percentile(band, (2, 98)))) / width if len(band) > 4 else 0.0)
    top = seen[rise > 0.86, 1]
    body = seen[(rise > 0.2) & (rise < 0.8), 1]
    if len(top) < 5 or len(body) < 5:
        return [*widths, 0.0]
    centre = np.percentile(top, (2, 98)).mean()
    left, right = np.percentile(body, (1, 99))
    return [*widths, abs((right - centre) - (centre - left)) / width]


def _hollow(seen: np.ndarray, rise: np.ndarray, width: float) -> list[float]:
    """Return how low, and how often, the object is seen in the middle below its top, and how much of it is top."""
    top = seen[rise >= min(0.85, rise.max())]
    centre = (np.percentile(top[:, :2], 3, axis=0) + np.percentile(top[:, :2], 97, axis=0)) / 2
    reach = max(float(np.ptp(np.percentile(top[:, 1], (3, 97)))) / 2, _LEAST)
    inside = np.linalg.norm(seen[:, :2] - centre, axis=1) < _INNER * reach
    share = float((rise > 0.9).mean())
    if inside.sum() < 4:
        return [1.0, 1.0, 0.0, share, 2 * reach / width]
    lowest, usual = np.percentile(rise[inside], (10, 50))
    return [float(lowest), float(usual), float(inside.mean()), share, 2 * reach / width]


def _front(seen: np.ndarray, rise: np.ndarray, width: float) -> list[float]:
    """Return how far the front lies behind its nearest part, by columns from left to right, as shares of the width."""
    body = seen[(rise > 0.1) & (rise < 0.85)]
    distances = np.full(_COLUMNS, np.nan)
    if len(body) > 20:
        low, high = np.percentile(body[:, 1], (2, 98))
        edges = np.linspace(low, high, _COLUMNS + 1)
        place = np.searchsorted(edges, body[:, 1]) - 1
        for k in range(_COLUMNS):
            own = body[place == k, 0]
            if len(own) > 2:
                distances[k] = np.percentile(own, 15)
    if np.isnan(distances).all():
        return [0.0] * _COLUMNS
    distances = (distances - np.nanmin(distances)) / width
    distances = np.where(np.isnan(distances), np.nanmax(distances), distances)
    # Left and right are the same: the shape and its mirror image have the same name.
    return list(distances if distances[:3].sum() <= distances[4:].sum() else distances[::-1])


def _fill(flat: np.ndarray) -> float:
    """Return the share that an outline (P, 2) has of its rectangle: 1 for rectangles, 0.79 for circles."""
    if len(flat) < 4:
        return 0.9
    hull = shapely.MultiPoint(flat).convex_hull
    whole = hull.minimum_rotated_rectangle.area
    return float(hull.area / whole) if whole > 1e-6 else 0.9


def _sides(flat: np.ndarray) -> tuple[float, float]:
    """Return the longer and the shorter side of the rectangle around an outline (P, 2), metres."""
    rectangle = shapely.MultiPoint(flat).minimum_rotated_rectangle
    if rectangle.geom_type != "Polygon":
        return max(float(rectangle.length), _LEAST), _LEAST
    corners = np.array(rectangle.exterior.coords)
    lengths = np.linalg.norm(np.diff(corners[:3], axis=0), axis=1)
    return max(float(lengths.max()), _LEAST), max(float(lengths.min()), _LEAST)
