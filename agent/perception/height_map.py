"""Measure how high every point lies above the table, with what uncertainty, and how far the table reaches.

No depth camera measures a flat plane: the depth of a RealSense varies by millimetres over decimetres, that of a Kinect
comes in steps. So the table is a smooth surface near its plane, and the noise is measured on the table itself, as it is
left after averaging over neighbours: cutlery is lost in a single pixel's noise, but not in the mean of ten.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage
from scipy.spatial import cKDTree

from agent.perception.table_parts import CELL, parts_joined, seen_through

_BAND = 0.025  # m about the plane: the table's points, and those that may be flat things on it
_CELL = CELL
_LEAST_APART = 0.03  # m2 of a level surface beside the table that is worth telling
_DEGREE = 3  # of that surface: waves of decimetres, and nothing as small as a plate
_OF_A_PLANE = [0, 1, _DEGREE + 1]  # of the polynomial's terms: 1, y and x
_ROUNDS = 4
_WINDOW = 3  # pixels across the neighbourhood of an organised cloud
_WIDE_WINDOW = 11  # pixels: as wide as a fork
_NEIGHBOURS = 12  # of an unorganised one
_BINS = 8  # of distance, in which the noise is measured
_LEAST_SIGMA = 0.0002  # m; no depth camera is better
_TALLEST = 0.3  # m: what is higher than that and hides the table is no object on it
_WALL, _UPRIGHT = 0.6, 2.0  # m up to which a wall is looked for, and times as many points above the table as on it
_FARTHEST_SHADE = 0.5  # m behind an object, up to where it hides the table
_INSIDE = 0.8  # of a part lies in the outline of the rest: it is table too


@dataclass(frozen=True)
class Relief:
    """Heights above the table of P points.

    Attributes:
        heights: (P,) metres, each point on its own.
        smooth: (P,) metres, the mean over neighbours of similar height.
        sigma: (P,) the standard deviation of `smooth` on the bare table.
        waves: (P,) the same after averaging over a few centimetres, which removes the errors of single pixels.
        outline: the convex outline of the visible table, level frame.
        apart: (K, 3) x, y, metres, level frame, and area, m2, of surfaces at the table's height that are apart from it.
    """

    heights: np.ndarray
    smooth: np.ndarray
    sigma: np.ndarray
    waves: np.ndarray
    outline: shapely.Polygon
    apart: np.ndarray


def table_relief(
    level: np.ndarray, eye: np.ndarray, distances: np.ndarray, pixels: np.ndarray, shape: tuple[int, int]
) -> Relief:
    """Return the heights of points above the table.

    Args:
        level: (P, 3) in the frame of the table's plane, metres.
        eye: (3,) where the camera is, in that frame.
        distances: (P,) from the camera, metres.
        pixels: (P,) the place of each in the flattened picture.
        shape: of the picture; an unorganised cloud has one row.
    """
    outline, apart = _outline(level, eye)
    shapely.prepare(outline)
    surface = _surface(level, outline)
    heights = level[:, 2] - surface
    smooth = heights.copy()
    near = np.abs(heights) < _BAND
    if shape[0] > 1:
        smooth[near] = _mean_in_picture(heights[near], pixels[near], shape, _WINDOW)
        wide = _mean_in_picture(heights[near], pixels[near], shape, _WIDE_WINDOW)
    else:
        _, neighbours = cKDTree(level[near]).query(level[near], k=min(_NEIGHBOURS, int(near.sum())))
        smooth[near] = heights[near][neighbours].mean(axis=1)
        # The neighbours' neighbours reach farther.
        wide = smooth[near][neighbours].mean(axis=1)
    on_table = near & shapely.contains_xy(outline, level[:, 0], level[:, 1])
    sigma = _sigma(smooth[on_table], distances[on_table], distances)
    waves = _sigma(wide[on_table[near]], distances[on_table], distances)
    return Relief(heights, smooth, sigma, waves, outline, apart)


def _outline(level: np.ndarray, eye: np.ndarray) -> tuple[shapely.Polygon, np.ndarray]:
    """Return the convex outline of the parts of the table that were seen, and what else is as high (K, 3)."""
    near = np.abs(level[:, 2]) < _BAND
    flat = level[near, :2]
    low = flat.min(axis=0)
    cells = np.zeros(np.ceil((flat.max(axis=0) - low) / _CELL).astype(int) + 1, dtype=bool)
    place = ((flat - low) / _CELL).astype(int)
    cells[place[:, 0], place[:, 1]] = True
    # A wall crosses the plane too.
    risen = ((level[(level[:, 2] > _BAND) & (level[:, 2] < _WALL), :2] - low) / _CELL).astype(int)
    risen = risen[((risen >= 0) & (risen < cells.shape)).all(axis=1)]
    higher, lower = (
        np.bincount(np.ravel_multi_index(tuple(which.T), cells.shape), minlength=cells.size).reshape(cells.shape)
        for which in (risen, place)
    )
    cells &= higher < _UPRIGHT * lower
    # A cell without neighbours is noise.
    cells &= ndimage.uniform_filter(cells.astype(np.float32), 3) > 3.5 / 9
    # Things that hide the table cut it into parts: those are connected by the things and by what they hide. What is
    # about as high but stands apart, a chair's seat, is none.
    covered = cells.copy()
    for points in _hidden(level[(level[:, 2] > _BAND) & (level[:, 2] < _TALLEST)], eye):
        row, column = ((points - low) / _CELL).astype(int).T
        inside = (row >= 0) & (row < cells.shape[0]) & (column >= 0) & (column < cells.shape[1])
        covered[row[inside], column[inside]] = True
    parts, _ = ndimage.label(covered, np.ones((3, 3)))
    parts = parts_joined(parts, cells, seen_through(level, eye, low, cells.shape))
    part = np.where(cells, parts, 0)[place[:, 0], place[:, 1]]
    chosen = _hull(flat[part == np.bincount(part[part > 0]).argmax()])
    inside = np.bincount(part, shapely.contains_xy(chosen, flat[:, 0], flat[:, 1])) / np.maximum(np.bincount(part), 1)
    own = (part > 0) & ((inside[part] > _INSIDE) | (part == np.bincount(part[part > 0]).argmax()))
    return _hull(flat[own]), _apart(np.where(cells, parts, 0), np.unique(part[own]), low)


def _apart(parts: np.ndarray, own: np.ndarray, low: np.ndarray) -> np.ndarray:
    """Return x, y and the area (K, 3) of the larger parts (A, B) that are not the table's own."""
    sizes = np.bincount(parts.ravel())
    others = [k for k in range(1, len(sizes)) if k not in own and sizes[k] * _CELL**2 > _LEAST_APART]
    places = [low + (np.argwhere(parts == k).mean(axis=0) + 0.5) * _CELL for k in others]
    return np.array([(*at, sizes[k] * _CELL**2) for k, at in zip(others, places, strict=True)]).reshape(-1, 3)


def _hidden(above: np.ndarray, eye: np.ndarray) -> list[np.ndarray]:
    """Return places (P, 2) on the table below points (P, 3) above it, and hidden behind them, in steps of a cell."""
    sight = above - eye
    shade = above[:, :2] - sight[:, :2] * (above[:, 2] / np.minimum(sight[:, 2], -1e-6))[:, None]
    away = shade - above[:, :2]
    length = np.linalg.norm(away, axis=1)
    away *= np.minimum(1.0, _FARTHEST_SHADE / np.maximum(length, 1e-9))[:, None]
    steps = int(np.ceil(min(length.max(initial=0.0), _FARTHEST_SHADE) / _CELL)) + 1
    return [above[:, :2] + share * away for share in np.linspace(0.0, 1.0, steps)]


def _hull(points: np.ndarray) -> shapely.Polygon:
    # As a line they are made at once, and their hull is the same.
    return shapely.LineString(points).convex_hull


def _surface(level: np.ndarray, outline: shapely.Polygon) -> np.ndarray:
    """Return z (P,) of the table at each point: a polynomial in x and y through the means of cells, without the
    objects on it.
    """
    x_low, y_low, x_high, y_high = outline.bounds
    near = (np.abs(level[:, 2]) < _BAND) & shapely.contains_xy(outline, level[:, 0], level[:, 1])
    columns = int((y_high - y_low) / _CELL) + 1
    cell = ((level[near, 0] - x_low) / _CELL).astype(int) * columns + ((level[near, 1] - y_low) / _CELL).astype(int)
    _, inverse, count = np.unique(cell, return_inverse=True, return_counts=True)
    means = np.stack([np.bincount(inverse, level[near, k]) / count for k in range(3)], axis=1)[count >= 3]
    middle, half = np.array([x_low + x_high, y_low + y_high]) / 2, np.array([x_high - x_low, y_high - y_low]) / 2

    def terms(points: np.ndarray) -> np.ndarray:
        # Beyond the table a polynomial runs away; there it stays what it is at the edge.
        x, y = np.clip((points[:, :2] - middle) / half, -1.0, 1.0).T
        return np.stack([x**i * y**j for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)], axis=1)

    basis, kept = terms(means), np.ones(len(means), dtype=bool)
    left = means[:, 2] - np.median(means[:, 2])
    # First the plane alone: a plate would bend the rest to itself before it is known for what it is.
    for kind in [_OF_A_PLANE] * _ROUNDS + [list(range(basis.shape[1]))] * _ROUNDS:
        spread = 1.48 * float(np.median(np.abs(left[kept])))
        # Things stand on a table, nothing hangs into it: what lies above is doubted sooner.
        kept = (left < max(2.0 * spread, 0.001)) & (left > -max(3.0 * spread, 0.001))
        if kept.sum() < 3 * basis.shape[1]:
            return np.zeros(len(level))
        fit = np.linalg.lstsq(basis[kept][:, kind], means[kept, 2], rcond=None)[0]
        left = means[:, 2] - basis[:, kind] @ fit
    return terms(level) @ np.linalg.lstsq(basis[kept], means[kept, 2], rcond=None)[0]


def _mean_in_picture(values: np.ndarray, pixels: np.ndarray, shape: tuple[int, int], window: int) -> np.ndarray:
    """Average over those of the neighbouring pixels that are given."""
    picture, there = np.zeros(shape[0] * shape[1], np.float32), np.zeros(shape[0] * shape[1], np.float32)
    picture[pixels], there[pixels] = values, 1.0
    total = ndimage.uniform_filter(picture.reshape(shape), window, mode="constant").ravel()[pixels]
    return total / ndimage.uniform_filter(there.reshape(shape), window, mode="constant").ravel()[pixels]


def _sigma(smooth: np.ndarray, distances: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the standard deviation of the table's smoothed heights at distances `at` (P,), from the points below
    it.
    """
    below = smooth < 0
    if not below.any():  # a camera without noise, or without any digits of it
        return np.full(len(at), _LEAST_SIGMA)
    edges = np.quantile(distances[below], np.linspace(0, 1, _BINS + 1))
    middles, spreads = [], []
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        chosen = below & (distances >= low) & (distances <= high)
        middles.append((low + high) / 2)
        spreads.append(1.48 * float(np.median(-smooth[chosen])))
    return np.maximum(np.interp(at, middles, spreads), _LEAST_SIGMA)
