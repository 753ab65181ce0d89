"""Read a depth picture of the table for tracking: what stands there, and what it says about a supposed body."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from agent.arm.tracked_shape import TrackedShape, color_features
from structdiffusion.geometry import lengths, transform_points
from structdiffusion.observation import Table
from structdiffusion.simulation.depth_camera import CameraImage

BESIDE_TABLE = 0.02  # m beyond the table's edges that objects may overhang
STRIDE = 2  # pixels between those that are used, in both directions: 4 mm at 1 m
LEAST_HEIGHT = 0.003  # m above the table: four standard deviations of the mean of nine pixels at 1 m
NOISE_BELOW = 0.006  # m below the table: three standard deviations of one pixel
MARGIN = 0.005  # m between a body and a measurement that agree: noise, and what completion errs by
COVERED = 0.0015  # m behind a measured surface: two standard deviations of the mean of nine pixels at 1 m
OWN_COLOR = 0.08  # distance of features within which a colour is one of a palette: light and shade differ by 0.05
TABLE_COLOR = 0.06  # the same for the table's colour, which fills most of the picture
# Points that tell the camera's focal lengths: there is no noise across the ray, so that a few would do.
LENS_POINTS, LEAST_LENS_POINTS = 2000, 10
FACING = 0.15  # cosine between a surface and the ray below which a camera hardly sees it


@dataclass(frozen=True)
class Evidence:
    """What a picture says about the side of a body that faces the camera.

    Attributes:
        supported: how many of its points lie on a measured surface of its colour.
        refuted: through how many the camera sees something behind them, or which have another colour.
        hidden: how many lie behind something, or outside the picture.
    """

    supported: int
    refuted: int
    hidden: int

    @property
    def share(self) -> float:
        """Return the share of what can be judged that is there: 1 where nothing is refuted."""
        return self.supported / max(1, self.supported + self.refuted)

    @property
    def refuted_share(self) -> float:
        """Return the share of the side facing the camera that is not there."""
        return self.refuted / max(1, self.supported + self.refuted + self.hidden)


class Sight:
    """A depth picture, read once.

    Args:
        picture: of which the segmentation is not read; pixels without depth (NaN) say nothing.
        table: the table top; what is not above it is no object.

    Attributes:
        eye: (3,) position of the camera, world frame, metres.
        points: (P, 3) what stands on the table, world frame, metres: every second pixel of every second row.
        features: (P, 4) colours, as `color_features` gives them.
        pixels: (P, 2) row and column of each, in steps of `STRIDE`.
        shape: rows and columns of the picture in such steps.
    """

    def __init__(self, picture: CameraImage, table: Table) -> None:
        self.eye = picture.world_from_camera[:3, 3]
        self._camera_from_world = np.linalg.inv(picture.world_from_camera)
        part = _over(picture, table)
        depth, points = np.asarray(picture.depth[part], dtype=np.float64), picture.points[part]
        measured = np.isfinite(depth)
        self._lens = _lens(points[measured], np.argwhere(measured), self._camera_from_world)
        mean = _mean(depth, measured)
        self._near = ndimage.minimum_filter(np.where(np.isfinite(mean), mean, np.inf), 3)
        self._far = ndimage.maximum_filter(np.where(np.isfinite(mean), mean, -np.inf), 3)
        self._features = color_features(picture.color[part])
        standing = self._standing(points, measured, table)
        self.shape = standing.shape
        self.pixels = np.argwhere(standing)
        few = np.s_[::STRIDE, ::STRIDE]
        self.points, self.features = points[few][standing], self._features[few][standing]

    def _standing(self, points: np.ndarray, measured: np.ndarray, table: Table) -> np.ndarray:
        """Return which of every second pixel of every second row (H, W) show what stands on the table."""
        few = np.s_[::STRIDE, ::STRIDE]
        smooth = _mean(points[..., 2], measured)[few]
        points, directions = points[few], self._features[few][..., :3]
        z = points[..., 2]
        with np.errstate(invalid="ignore"):
            over = _above(points, table)
            low = over & (np.abs(z) < NOISE_BELOW)
            high = over & (smooth > LEAST_HEIGHT) & (z > 0.0)
            low_enough = over & (z > -NOISE_BELOW)
        color = np.median(directions[low], axis=0) if low.any() else np.zeros(3)
        return high | (low_enough & (np.linalg.norm(directions - color, axis=-1) > TABLE_COLOR))

    def evidence(self, shape: TrackedShape, world_from_shape: np.ndarray) -> Evidence:
        """Compare a body at a supposed pose (4, 4) with the picture."""
        facing, empty, there, before, (rows, columns) = self._compared(shape, world_from_shape)
        own = self._own(shape, rows, columns, there)
        # What is of another colour and a little nearer may be something thin that lies on it.
        supported, refuted = int(own.sum()), int(empty.sum() + (there & ~own & ~before).sum())
        return Evidence(supported, refuted, int(facing.sum()) - supported - refuted)

    def empty(self, shape: TrackedShape, world_from_shape: np.ndarray) -> np.ndarray:
        """Return through which samples (S,) of a body at a supposed pose (4, 4) the camera sees something behind."""
        return self._compared(shape, world_from_shape)[1]

    def _compared(
        self, shape: TrackedShape, world_from_shape: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
        """Return which samples (S,) face the camera, which of those are in empty space, which on a measured surface and
        which a little behind it, and the row and column of each.
        """
        points = transform_points(world_from_shape, shape.samples)
        rays = self.eye - points
        normals = shape.normals @ world_from_shape[:3, :3].T
        facing = (normals * rays).sum(axis=1) > FACING * lengths(rays)
        depth, rows, columns, inside = self._project(points)
        near, far = self._near[rows, columns], self._far[rows, columns]
        inside &= facing & np.isfinite(near)
        empty = inside & (depth < near - MARGIN)
        there = inside & ~empty & (depth <= far + MARGIN)
        return facing, empty, there, there & (depth > far + COVERED), (rows, columns)

    def _own(self, shape: TrackedShape, rows: np.ndarray, columns: np.ndarray, there: np.ndarray) -> np.ndarray:
        """Return at which pixels (S,) one of nine has a colour of the shape; only those `there` are asked."""
        own = np.zeros(len(rows), dtype=bool)
        height, width = self._near.shape
        for down, right in itertools.product((0, -1, 1), (0, -1, 1)):
            asked = np.flatnonzero(there & ~own)
            at = (rows[asked] + down).clip(0, height - 1), (columns[asked] + right).clip(0, width - 1)
            own[asked] = of_palette(self._features[at], shape.palette)
        return own

    def _project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        camera = transform_points(self._camera_from_world, points)
        depth = camera[:, 2]
        pixels = np.stack((camera[:, 1], camera[:, 0]), axis=1) / np.maximum(depth, 1e-6)[:, None]
        pixels = np.floor(pixels * self._lens[0] + self._lens[1]).astype(np.int64)
        size = np.array(self._near.shape)
        inside = (depth > 0) & ((pixels >= 0) & (pixels < size)).all(axis=1)
        rows, columns = pixels.clip(0, size - 1).T
        return depth, rows, columns, inside


def of_palette(features: np.ndarray, palette: np.ndarray) -> np.ndarray:
    """Return which colours (P, 4) are near one of a palette (C, 4); all of them where it is empty."""
    if not len(palette):
        return np.ones(len(features), dtype=bool)
    return lengths(features[:, None] - palette[None]).min(axis=1) < OWN_COLOR


def hue_distance(features: np.ndarray, palette: np.ndarray) -> float:
    """Return the mean distance of colours (P, 4) from the nearest of a palette (C, 4), whatever the light; 0 if either
    is empty.
    """
    if not len(palette) or not len(features):
        return 0.0
    return float(lengths(features[:, None, :3] - palette[None, :, :3]).min(axis=1).mean())


def _mean(values: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Return the mean (H, W) of the measured pixels among nine; NaN where there is none."""
    share = ndimage.uniform_filter(measured.astype(np.float64), 3)
    total = ndimage.uniform_filter(np.where(measured, values, 0.0), 3)
    return np.where(share > 0.05, total / np.maximum(share, 1e-9), np.nan)


def _above(points: np.ndarray, table: Table) -> np.ndarray:
    """Return which points (..., 3) lie above the table or a little beside it; NaN does not."""
    x, y = points[..., 0], points[..., 1]
    with np.errstate(invalid="ignore"):
        along = (x > table.x_min - BESIDE_TABLE) & (x < table.x_max + BESIDE_TABLE)
        return along & (y > table.y_min - BESIDE_TABLE) & (y < table.y_max + BESIDE_TABLE)


def _over(picture: CameraImage, table: Table) -> tuple[slice, slice]:
    """Return the rows and columns of a picture that show the table and what stands on it."""
    over = _above(picture.points, table)
    if not over.any():
        return slice(None), slice(None)
    rows, columns = (np.flatnonzero(over.any(axis=axis)) for axis in (1, 0))
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)


def _lens(points: np.ndarray, pixels: np.ndarray, camera_from_world: np.ndarray) -> np.ndarray:
    """Return the focal lengths and the principal point (2, 2), each row first, pixels, as measured points tell them;
    zeros if there are too few.

    Args:
        points: (P, 3) world frame, metres.
        pixels: (P, 2) their rows and columns.
        camera_from_world: (4, 4).
    """
    if len(points) < LEAST_LENS_POINTS:
        return np.zeros((2, 2))
    few = slice(None, None, max(1, len(points) // LENS_POINTS))
    camera = transform_points(camera_from_world, points[few])
    across = camera[:, 1::-1] / camera[:, 2:]
    middles = pixels[few] + 0.5
    return np.array([np.polyfit(across[:, k], middles[:, k], 1) for k in (0, 1)]).T
