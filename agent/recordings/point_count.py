"""Reduce measurements with more points than perception needs: it looks at objects in voxels of four millimetres."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from agent.recordings.recording import DepthFrame

_MOST_ORGANISED = 1_600_000  # pixels: what industrial cameras give is halved in both directions
_MOST_UNORGANISED = 400_000
_FINEST, _COARSER = 0.0015, 1.4  # m between the points that are kept first, and by which factor it grows
_CHUNK = 1_000_000  # points that are sorted into cells at once


def with_fewer_points(frame: DepthFrame) -> tuple[DepthFrame, str]:
    """Reduce the points of a large measurement.

    Returns:
        The measurement and a note. An organised one keeps every second or third row and column; an unorganised one
        keeps one measured point in each small cube. A measurement that is not large stays the same, with the note "".
    """
    height, width = frame.points.shape[:2]
    if not frame.organised:
        return _one_in_each_cube(frame)
    step = step_of(height, width)
    if step < 2:
        return frame, ""
    intrinsics = None if frame.intrinsics is None else lens_of_every(frame.intrinsics, step)
    color = None if frame.color is None else frame.color[::step, ::step]
    points = np.ascontiguousarray(frame.points[::step, ::step])
    return replace(frame, points=points, color=color, intrinsics=intrinsics), told_of(height, width)


def step_of(height: int, width: int) -> int:
    """Return which rows and columns of a picture are used: every first, every second, and so on."""
    return max(1, math.ceil(math.sqrt(height * width / _MOST_ORGANISED)))


def lens_of_every(matrix: np.ndarray, step: int) -> np.ndarray:
    """Return the lens (3, 3) of every `step`-th row and column of the picture that has the lens `matrix`."""
    return np.diag((1 / step, 1 / step, 1.0)) @ matrix


def told_of(height: int, width: int) -> str:
    """Return which rows and columns of a picture were used, a sentence; "" for all."""
    step = step_of(height, width)
    if step < 2:
        return ""
    return f"of {height} rows and {width} columns, every {'second' if step == 2 else f'{step}th'} was used"


def _one_in_each_cube(frame: DepthFrame) -> tuple[DepthFrame, str]:
    total = frame.points.shape[1]
    if total <= _MOST_UNORGANISED:
        return frame, ""
    points = frame.points[0]
    kept = np.flatnonzero(np.isfinite(points).all(axis=1))
    size = _FINEST
    kept = np.concatenate(
        [_firsts(points, kept[start : start + _CHUNK], size) for start in range(0, len(kept), _CHUNK)]
    )
    kept = _firsts(points, kept, size)
    while len(kept) > _MOST_UNORGANISED:
        size *= _COARSER
        kept = _firsts(points, kept, size)
    color = None if frame.color is None else frame.color[:, kept]
    note = f"of {total} points, {len(kept)} were used: one in each cube of {size * 1000:.1f} mm"
    return replace(frame, points=points[None, kept], color=color), note


def _firsts(points: np.ndarray, chosen: np.ndarray, size: float) -> np.ndarray:
    """Return those of the chosen points (K,) that are the first in their cube of `size` metres, in their order."""
    cells = np.floor(points[chosen] / np.float32(size)).astype(np.int32)
    cells -= cells.min(axis=0)
    across, deep = (int(n) + 1 for n in cells[:, 1:].max(axis=0))
    keys = (cells[:, 0].astype(np.int64) * across + cells[:, 1]) * deep + cells[:, 2]
    return chosen[np.sort(np.unique(keys, return_index=True)[1])]
