"""Paint the surroundings of a table into pictures: its legs, the arm's pedestal, and the floor.

The scenery is part neither of physics nor of the depth camera's measurements; without it an arm and a table seem to
float. Lengths in metres, world frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from structdiffusion.observation import Table
from structdiffusion.simulation.depth_camera import DepthCamera

FLOOR = -0.42  # z: low enough for the height of a table, high enough to be visible in pictures
_LEG, _INSET, _TABLE_THICKNESS = 0.045, 0.01, 0.04
_PEDESTAL = 0.11  # half of its side
_TILE, _SEAM = 0.3, 0.006  # of the floor
_WOOD, _METAL = (168, 146, 120), (150, 155, 164)
_STONE, _JOINT, _FAR = (226, 228, 232), (208, 211, 217), (247, 248, 250)
_FADES = (1.2, 4.0)  # m: the distances at which the floor begins to fade, and at which it has faded
_SHADES = (0.82, 0.92, 1.0)  # of faces across x, y and z


@dataclass(frozen=True)
class Backdrop:
    """A painted picture and the depth of its pixels.

    Attributes:
        color: (H, W, 3) uint8.
        depth: (H, W) along the camera's z; infinite where nothing is.
    """

    color: np.ndarray
    depth: np.ndarray

    def behind(self, color: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """Return a picture (H, W, 3) uint8 with the backdrop wherever it is nearer; `depth` (H, W) is NaN for
        background.
        """
        nearer = ~(depth <= self.depth)
        return np.where(nearer[..., None], self.color, color)


def backdrop(camera: DepthCamera, ground: Table, base: tuple[float, float, float] | None = None) -> Backdrop:
    """Paint the floor, the legs of a table and the pedestal of an arm, as a camera sees them.

    Args:
        camera: the camera.
        ground: the table's whole surface, at z = 0.
        base: position of the arm; without it, or if it is on the table, there is no pedestal.
    """
    size = (camera.height, camera.width)
    pose = camera.world_from_camera
    eye = pose[:3, 3].astype(np.float32)
    rays = (camera.points(np.ones(size)) - pose[:3, 3]).astype(np.float32)  # 1 m long along the camera's z
    color = np.broadcast_to(np.array(_FAR, dtype=np.float32), (*size, 3)).copy()
    depth = np.full(size, np.inf, dtype=np.float32)
    boxes = [(low, high, _WOOD) for low, high in _legs(ground)]
    if base is not None and not _is_on(ground, base):
        low, high = np.subtract(base, (_PEDESTAL, _PEDESTAL, 0.0)), np.add(base, (_PEDESTAL, _PEDESTAL, 0.0))
        low[2] = FLOOR
        boxes.append((low, high, _METAL))
    with np.errstate(divide="ignore", invalid="ignore"):
        _paint_floor(eye, rays, color, depth)
        for low, high, paint in boxes:
            part = _part(camera, low, high)
            _paint_box(eye, rays[part], low, high, paint, color[part], depth[part])
    return Backdrop(color.round().astype(np.uint8), depth)


def _part(camera: DepthCamera, low: np.ndarray, high: np.ndarray) -> tuple[slice, slice]:
    """Return the rows and columns of the picture that can contain a box."""
    corners = np.array(np.meshgrid(*np.stack((low, high), axis=1))).reshape(3, -1).T
    pose = camera.world_from_camera
    if (((corners - pose[:3, 3]) @ pose[:3, 2]) < camera.near).any():
        return slice(None), slice(None)
    columns, rows = camera.pixels(corners).T
    top, bottom = (int(np.clip(end, 0, camera.height)) for end in (rows.min() - 1, rows.max() + 2))
    left, right = (int(np.clip(end, 0, camera.width)) for end in (columns.min() - 1, columns.max() + 2))
    return slice(top, bottom), slice(left, right)


def _is_on(ground: Table, base: tuple[float, float, float]) -> bool:
    return ground.x_min <= base[0] <= ground.x_max and ground.y_min <= base[1] <= ground.y_max


def _legs(ground: Table) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the lowest and highest corner of each leg."""
    xs = (ground.x_min + _INSET, ground.x_max - _INSET - _LEG)
    ys = (ground.y_min + _INSET, ground.y_max - _INSET - _LEG)
    lows = [np.array((x, y, FLOOR)) for x in xs for y in ys]
    return [(low, low + (_LEG, _LEG, -FLOOR - _TABLE_THICKNESS)) for low in lows]


def _paint_floor(eye: np.ndarray, rays: np.ndarray, color: np.ndarray, depth: np.ndarray) -> None:
    """Paint tiles that fade with the distance."""
    along = (FLOOR - eye[2]) / rays[..., 2]
    hit = (along > 0) & (along < depth)
    points = eye + along[..., None] * rays
    seam = (np.abs((points[..., :2] + _TILE / 2) % _TILE) < _SEAM).any(axis=-1)
    near, far = _FADES
    share = np.clip((np.linalg.norm(points - eye, axis=-1) - near) / (far - near), 0.0, 1.0)[..., None]
    tiles = np.where(seam[..., None], _JOINT, _STONE).astype(np.float32)
    color[hit] = ((1 - share) * tiles + share * np.array(_FAR))[hit]
    depth[hit] = along[hit]


def _paint_box(
    eye: np.ndarray,
    rays: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    paint: tuple[int, int, int],
    color: np.ndarray,
    depth: np.ndarray,
) -> None:
    """Paint a box between two corners, with faces shaded by their direction."""
    first, second = (low.astype(np.float32) - eye) / rays, (high.astype(np.float32) - eye) / rays
    enters, leaves = np.minimum(first, second), np.maximum(first, second)
    along = enters.max(axis=-1)
    hit = (along > 0) & (along <= leaves.min(axis=-1)) & (along < depth)
    shade = np.array(_SHADES)[enters.argmax(axis=-1)]
    color[hit] = (shade[..., None] * np.array(paint, dtype=float))[hit]
    depth[hit] = along[hit]
