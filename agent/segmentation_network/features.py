"""Make the network's input of an organised cloud: heights, normals and distances in the frame of the table."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

CHANNELS = 12
WIDTH = 160  # pixels across that the network is trained on
_COARSE, _FINE = 0.12, 0.012  # m of height: of whole objects, and of what is flat
_USUAL_PIXEL = 0.006  # m across, at usual distances
_NEAR = 0.06  # m in depth: farther neighbours are another surface


def chosen_of_blocks(depth: np.ndarray, size: int) -> np.ndarray:
    """Return for each block of `size` x `size` pixels the flat index of its pixel of middle depth, of those measured.

    Args:
        depth: (H, W), NaN where nothing was measured; a block without any measurement has one of its pixels.
        size: of the blocks; rows and columns that fill no block are left out.
    """
    rows, columns = depth.shape[0] // size, depth.shape[1] // size
    apart = depth[: rows * size, : columns * size].reshape(rows, size, columns, size).transpose(0, 2, 1, 3)
    blocks = apart.reshape(rows, columns, size * size)
    known = np.isfinite(blocks).sum(axis=-1)
    order = np.argsort(blocks, axis=-1)  # NaN last
    middle = np.take_along_axis(order, np.maximum((known - 1) // 2, 0)[..., None], axis=-1)[..., 0]
    row = np.arange(rows)[:, None] * size + middle // size
    return row * depth.shape[1] + np.arange(columns) * size + middle % size


def features(
    level: np.ndarray, heights: np.ndarray, eye: np.ndarray, pitch: float, lab: np.ndarray | None
) -> np.ndarray:
    """Return the network's input (CHANNELS, H, W) float32.

    Args:
        level: (H, W, 3) points, z up, x the camera's direction of view, metres; NaN where nothing was measured.
        heights: (H, W) above the table, metres.
        eye: (3,) where the camera is.
        pitch: tangent of the angle between neighbouring pixels in the picture's middle.
        lab: (H, W, 3) colours in CIELAB, or `None`.
    """
    known = np.all(np.isfinite(level), axis=-1)
    sight = np.where(known[..., None], level - eye, 0.0)
    distance = np.linalg.norm(sight, axis=-1)
    maps = np.zeros((CHANNELS, *known.shape), dtype=np.float32)
    maps[0] = known
    maps[1] = np.clip(heights / _COARSE, -2.0, 5.0)
    maps[2] = np.clip(heights / _FINE, -3.0, 5.0)
    maps[3:6] = surface_normals(level, distance, known, eye).transpose(2, 0, 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        maps[6] = np.log(np.maximum(distance * pitch / _USUAL_PIXEL, 1e-3))
        maps[7] = -2.0 * sight[..., 2] / np.maximum(distance, 1e-6)
    if lab is not None:
        maps[8:11] = ((lab - (55.0, 0.0, 0.0)) / (30.0, 30.0, 30.0)).transpose(2, 0, 1)
        maps[11] = 1.0
    return np.where(known, maps, 0.0).astype(np.float32)


def surface_normals(level: np.ndarray, distance: np.ndarray, known: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """Return normals (H, W, 3) toward the camera of points smoothed over 3 x 3 pixels; 0 where there are none."""
    weight = ndimage.uniform_filter(known.astype(np.float32), 3, mode="constant")
    smooth = np.empty(level.shape, dtype=np.float32)
    for axis in range(3):
        values = np.where(known, level[..., axis], 0.0).astype(np.float32)
        smooth[..., axis] = ndimage.uniform_filter(values, 3, mode="constant") / np.maximum(weight, 1e-6)
    across = [_difference(smooth, distance, known, axis) for axis in (0, 1)]
    normal = np.cross(across[0], across[1])
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    toward = np.where(known[..., None], eye - level, 0.0)
    normal *= np.sign((normal * toward).sum(axis=-1, keepdims=True))
    return np.where(length > 1e-9, normal / np.maximum(length, 1e-9), 0.0)


def _difference(smooth: np.ndarray, distance: np.ndarray, known: np.ndarray, axis: int) -> np.ndarray:
    """Return the difference (H, W, 3) of neighbouring points along an axis; 0 where both belong to other surfaces."""
    ahead = np.zeros(smooth.shape, dtype=np.float32)
    low, high = (np.s_[:-1], np.s_[1:]) if axis == 0 else (np.s_[:, :-1], np.s_[:, 1:])
    one = known[low] & known[high] & (np.abs(distance[high] - distance[low]) < _NEAR)
    step = np.where(one[..., None], smooth[high] - smooth[low], 0.0)
    ahead[low] += step
    ahead[high] += step
    return ahead
