"""Make training batches of pooled views: crops, reflections, scales, planes with errors, noise, colours or none."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from agent.perception.color import lab
from agent.segmentation_network.features import features
from agent.training.segmentation.pool import Pool
from agent.training.segmentation.views import HEIGHT, WIDTH, View
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points

LEAST = 12  # pixels of an object that the network has to find
_WITHOUT_COLOR = 0.5  # share of the views
_ZOOMED = 0.6
_UNIT = 1e-4  # m of a view's depth
_TILT, _LIFT = math.radians(0.35), 0.002  # standard deviations of the plane's errors


@dataclass(frozen=True)
class Example:
    """A view as the network sees it.

    Attributes:
        maps: (CHANNELS, H, W) float32.
        level: (H, W, 3) float32 points, metres; 0 where nothing was measured.
        known: (H, W) what was measured.
        truth: (H, W) 0 beside the table, 1 the table, object k has k + 1.
    """

    maps: np.ndarray
    level: np.ndarray
    known: np.ndarray
    truth: np.ndarray


def draw_batch(pool: Pool, size: int, rng: np.random.Generator) -> list[Example]:
    """Draw some views of a pool, each varied."""
    return [varied(pool[int(rng.integers(pool.count))], rng) for _ in range(size)]


def varied(view: View, rng: np.random.Generator) -> Example:
    """Return a view with another crop, scale, reflection, noise, plane and colours."""
    columns = (np.arange(WIDTH) + 0.5 - WIDTH / 2) / view.focal
    rows = (np.arange(HEIGHT) + 0.5 - HEIGHT / 2) / view.focal
    scale = rng.uniform(0.8, 1.25)
    depth = view.depth * (_UNIT * scale)
    depth *= 1.0 + rng.uniform(0.0, 0.001) * rng.standard_normal(depth.shape)
    known = (view.depth > 0) & ~_lost(rng)
    points = np.stack((*np.meshgrid(columns, rows), np.ones(depth.shape)), axis=-1) * depth[..., None]
    scaled = view.level_from_camera.astype(np.float64)
    scaled[:3, 3] *= scale
    level = transform_points(scaled, points.reshape(-1, 3)).reshape(points.shape)
    eye, color, truth = scaled[:3, 3].copy(), view.color, view.truth
    level, eye = _off_plane(level, eye, known, rng)
    if rng.random() < 0.5:
        level, known, color, truth = (array[:, ::-1] for array in (level, known, color, truth))
        level, eye = level * (1.0, -1.0, 1.0), eye * (1.0, -1.0, 1.0)
    zoom = 1.0
    if rng.random() < _ZOOMED:
        zoom = math.exp(rng.uniform(-0.25, 0.5))
        row, column, inside = _crop(zoom, rng)
        level, color, truth = (array[row, column] for array in (level, color, truth))
        known = known[row, column] & inside
    shades = None if rng.random() < _WITHOUT_COLOR else _other_light(color, rng)
    level = np.where(known[..., None], level, np.nan)
    maps = features(level, level[..., 2], eye, 1.0 / (view.focal * zoom), shades)
    points = np.nan_to_num(level, nan=0.0).astype(np.float32)
    return Example(maps, points, known, np.where(known, truth, 0))


def _off_plane(
    level: np.ndarray, eye: np.ndarray, known: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return points and camera relative to a plane that is fitted as badly as planes are."""
    middle = np.median(level[known], axis=0) if known.any() else np.zeros(3)
    slope, lift = rng.normal(0.0, _TILT, 2), rng.normal(0.0, _LIFT)
    level = level.copy()
    level[..., 2] += (level[..., :2] - middle[:2]) @ slope + lift
    turn = pose_from_xyz_yaw(middle[0], middle[1], 0.0, rng.normal(0.0, 0.05))
    turn[:2, 3] -= turn[:2, :2] @ middle[:2]
    return transform_points(turn, level.reshape(-1, 3)).reshape(level.shape), transform_points(turn, eye[None])[0]


def _lost(rng: np.random.Generator) -> np.ndarray:
    """Return pixels (H, W) without measurement: in some views small patches, or scattered ones."""
    lost = np.zeros((HEIGHT, WIDTH), dtype=bool)
    if rng.random() < 0.3:
        coarse = ndimage.zoom(rng.random((HEIGHT // 4 + 1, WIDTH // 4 + 1)), 4, order=1)[:HEIGHT, :WIDTH]
        lost |= coarse > np.quantile(coarse[::3, ::3], 1.0 - rng.uniform(0.0, 0.05))
    if rng.random() < 0.2:
        lost |= rng.random(lost.shape) < rng.uniform(0.0, 0.05)
    return lost


def _crop(zoom: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the rows, columns and whether they lie in the picture, (H, W) each, of a part that is shown larger."""
    shift = rng.uniform(-1.0, 1.0, 2) * abs(1.0 - 1.0 / zoom) / 2
    row = np.floor((np.arange(HEIGHT) + 0.5 - HEIGHT / 2) / zoom + HEIGHT * (0.5 + shift[0])).astype(int)
    column = np.floor((np.arange(WIDTH) + 0.5 - WIDTH / 2) / zoom + WIDTH * (0.5 + shift[1])).astype(int)
    inside = ((row >= 0) & (row < HEIGHT))[:, None] & ((column >= 0) & (column < WIDTH))
    return np.clip(row, 0, HEIGHT - 1)[:, None], np.clip(column, 0, WIDTH - 1)[None], inside


def _other_light(color: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return colours (H, W, 3) in CIELAB under other light, contrast and hue."""
    shades = lab(color.reshape(-1, 3)).reshape(color.shape)
    shades = shades * rng.uniform(0.7, 1.2, 3) + rng.normal(0.0, (6.0, 5.0, 5.0))
    turn, saturation = rng.uniform(-math.pi, math.pi), rng.uniform(0.2, 1.0)
    cosine, sine = saturation * math.cos(turn), saturation * math.sin(turn)
    shades[..., 1:] = shades[..., 1:] @ np.array([[cosine, sine], [-sine, cosine]])
    return shades
