"""Compute how much light falls on the table and the floor: from a lamp of some size, and from the whole ceiling."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter
from scipy.sparse import csr_array

from structdiffusion.observation import Table

LAMP = np.array((-0.50, -0.38, 1.0)) / np.linalg.norm((-0.50, -0.38, 1.0))  # behind the arm, at its right
LAMP_RADIUS = 0.10  # as a share of its distance
KEY, SKY = 0.62, 0.50  # brightness of lamp and ceiling on a face that is turned to them
LIFT = 5e-4  # m that a ray starts above its surface
_LAMP_RAYS, _SKY_RAYS = 4, 4  # from each square
_BLOCK = 3  # squares across a block in which each has rays of its own; their mean over a block is smooth


class LitPlane:
    """A horizontal rectangle, divided into squares.

    Args:
        extent: its x and y.
        z: its height.
        square: the side of a square, metres.
        glow: the share of its light that no body can take.
    """

    def __init__(self, extent: Table, z: float, square: float, glow: float = 0.0) -> None:
        self._glow = glow
        self._low, self._square = np.array((extent.x_min, extent.y_min)), square
        xs = np.arange(extent.x_min + square / 2, extent.x_max, square)
        ys = np.arange(extent.y_min + square / 2, extent.y_max, square)
        self._shape = (len(xs), len(ys))
        squares = np.stack((*np.meshgrid(xs, ys, indexing="ij"), np.full(self._shape, z + LIFT)), axis=-1)
        lamp, sky = _directions()
        which = (np.arange(len(xs))[:, None] % _BLOCK) * _BLOCK + np.arange(len(ys)) % _BLOCK
        self._weights = (KEY * LAMP[2] / _LAMP_RAYS, SKY / _SKY_RAYS)
        toward = np.concatenate((lamp, sky), axis=1)[which]  # (X, Y, rays, 3)
        origins = np.broadcast_to(squares[:, :, None], toward.shape)
        self._rays = np.concatenate((origins, toward), axis=-1).astype(np.float32)

    def light(self, scene: Any) -> np.ndarray:
        """Return the brightness of each square (X, Y) among what `scene` (an Open3D `RaycastingScene`) holds."""
        import open3d

        rays = open3d.core.Tensor(self._rays.reshape(-1, 6))
        free = ~scene.test_occlusions(rays).numpy().reshape(*self._shape, -1)
        lamp, sky = free[..., :_LAMP_RAYS].sum(axis=2), free[..., _LAMP_RAYS:].sum(axis=2)
        bright = (self._weights[0] * lamp + self._weights[1] * sky).astype(np.float32)
        return self._glow * (KEY * LAMP[2] + SKY) + (1 - self._glow) * uniform_filter(bright, _BLOCK, mode="nearest")

    def interpolation(self, points: np.ndarray) -> csr_array:
        """Return the matrix (P, X * Y) from the brightness of the squares to that at points (P, 2) between them."""
        place = np.clip((points - self._low) / self._square - 0.5, 0, np.subtract(self._shape, 1.001))
        first = place.astype(int)
        share = place - first
        rows = np.repeat(np.arange(len(points)), 4)
        columns = [(first[:, 0] + i) * self._shape[1] + first[:, 1] + j for i in (0, 1) for j in (0, 1)]
        weights = [np.abs(1 - i - share[:, 0]) * np.abs(1 - j - share[:, 1]) for i in (0, 1) for j in (0, 1)]
        entries = (np.stack(weights, axis=1).ravel().astype(np.float32), (rows, np.stack(columns, axis=1).ravel()))
        return csr_array(entries, shape=(len(points), self._shape[0] * self._shape[1]))


def lamp_points(count: int) -> np.ndarray:
    """Return directions (count, 3) to points spread evenly over the lamp."""
    number = np.arange(count) + 0.5
    radius, turn = LAMP_RADIUS * np.sqrt(number / count), number * np.pi * (3 - np.sqrt(5))
    side = np.cross(LAMP, (0.0, 0.0, 1.0))
    side /= np.linalg.norm(side)
    across = np.cross(LAMP, side)
    toward = LAMP + radius[:, None] * (np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * across)
    return toward / np.linalg.norm(toward, axis=1, keepdims=True)


def _directions() -> tuple[np.ndarray, np.ndarray]:
    """Return the rays to the lamp (kinds, rays, 3) and to the ceiling of each kind of square in a block."""
    kinds = _BLOCK**2
    lamp = lamp_points(kinds * _LAMP_RAYS).reshape(_LAMP_RAYS, kinds, 3).swapaxes(0, 1)
    number = np.arange(kinds * _SKY_RAYS) + 0.5
    # Weighted with the cosine, and without the rays close to the horizon, whose shadows would be long stripes.
    level, turn = 0.85 * np.sqrt(number / len(number)), number * np.pi * (3 - np.sqrt(5))
    sky = np.stack((level * np.cos(turn), level * np.sin(turn), np.sqrt(1 - level**2)), axis=1)
    return lamp, sky.reshape(_SKY_RAYS, kinds, 3).swapaxes(0, 1)
