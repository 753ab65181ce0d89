"""Render training views at a quarter of a camera's resolution, with the errors of three depth cameras."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from agent.segmentation_network.features import chosen_of_blocks
from agent.synthetic_tables.rendering import (
    TABLE,
    Hits,
    camera_rays,
    cast,
    colors,
    facing,
    ray_scene,
    visible,
)
from agent.synthetic_tables.sensors import SENSORS, DepthSensor, fattened, flying
from agent.training.segmentation.scenes import eye_beside, level_from, training_camera, training_scene

WIDTH, HEIGHT = 160, 120  # of a view
_FINE = 2  # rays across each of its pixels
_FULL = 640 // (WIDTH * _FINE)  # of a camera's pixels that a ray stands for
_LEAST_SEEN = 12  # pixels of an object
_STEEP = 0.22  # cosine of the angle of view below which a surface is often lost
_UNIT = 1e-4  # m: depth is kept in tenths of a millimetre


@dataclass(frozen=True)
class View:
    """What a camera measured of a training table.

    Attributes:
        depth: (H, W) uint16, tenths of a millimetre; 0 where nothing was measured.
        truth: (H, W) uint8: 0 beside the table, 1 the table, object k has k + 1.
        color: (H, W, 3) uint8 RGB.
        focal: pixels of the view.
        level_from_camera: (4, 4) float32, z up from the table.
    """

    depth: np.ndarray
    truth: np.ndarray
    color: np.ndarray
    focal: float
    level_from_camera: np.ndarray


def draw_views(rng: np.random.Generator, count: int) -> list[View]:
    """Draw a table and at most `count` views of it; those that show too little are left out."""
    placed, parts = training_scene(rng)
    scene = ray_scene(parts)
    views = []
    for _ in range(count):
        sensor = SENSORS[int(rng.integers(len(SENSORS)))]
        camera = training_camera(placed, rng)
        focal = sensor.focal / _FULL * rng.uniform(0.9, 1.1)
        rays = camera_rays(camera, focal, WIDTH * _FINE, HEIGHT * _FINE)
        hits = cast(scene, rays)
        truth = np.where(hits.there, np.array([part.number for part in parts])[hits.own], TABLE - 1) + 1
        if (truth > 1).sum() < 2 * _LEAST_SEEN * _FINE**2:
            continue
        shadow = hits.there & ~visible(scene, hits, eye_beside(camera, sensor.baseline))
        dark = np.array([part.dark for part in parts])[hits.own]
        depth = _measured(hits.distance, facing(hits, rays), shadow, dark, sensor, focal, rng)
        lamp = np.array([*rng.uniform(-1.5, 1.5, 2), rng.uniform(1.2, 2.5)])
        chosen = chosen_of_blocks(depth, _FINE)
        depth, truth = depth.ravel()[chosen], np.maximum(truth, 0).ravel()[chosen]
        picture = colors(parts, _only(hits, chosen), lamp, np.zeros(chosen.shape, dtype=bool), rng)
        kept = np.where(np.isfinite(depth), depth / _UNIT, 0.0)
        views.append(
            View(
                np.clip(np.round(kept), 0, 65535).astype(np.uint16), truth.astype(np.uint8),
                picture, focal / _FINE, level_from(camera).astype(np.float32),
            )
        )  # fmt: skip
    return views


def _only(hits: Hits, chosen: np.ndarray) -> Hits:
    """Return what the rays of the flat indices (H, W) meet."""
    flat = (getattr(hits, name) for name in ("there", "distance", "own", "points", "normals"))
    return Hits(*(values.reshape(-1, *values.shape[2:])[chosen] for values in flat))


def _measured(
    depth: np.ndarray,
    cosine: np.ndarray,
    shadow: np.ndarray,
    dark: np.ndarray,
    sensor: DepthSensor,
    focal: float,
    rng: np.random.Generator,
) -> np.ndarray:
    """Return the depth (H, W) that a sensor measures at half its resolution, NaN where it measures nothing.

    The strength of every error varies from view to view: no camera is like its model.
    """
    shape = depth.shape
    there = np.isfinite(depth)
    seen = np.where(there, depth, 10.0)
    if rng.random() < 0.7:
        seen = fattened(seen, sensor, rng)
    if rng.random() < 0.7:
        seen = flying(seen, sensor, rng)
    disparity = focal * sensor.baseline / seen
    fine, strength = rng.standard_normal(shape), rng.uniform(0.3, 1.5) * sensor.noise / _FULL
    noise = ndimage.uniform_filter(fine, 3) * 3 if rng.random() < 0.5 else fine
    disparity = disparity + strength * noise
    disparity *= 1.0 + rng.uniform(0.0, 1.5) * sensor.waves * _smooth(shape, 12, rng)
    step = sensor.step / _FULL
    disparity = np.round(disparity / step) * step
    patches = _smooth(shape, 120, rng)
    lost = patches > np.quantile(patches[::4, ::4], 1.0 - sensor.lost * rng.uniform(0.2, 1.3))
    holes = (lost & (dark | (cosine < _STEEP))) | ~there | (seen > 5.0)
    if rng.random() < 0.9:
        holes |= shadow
    return np.where(holes, np.nan, focal * sensor.baseline / np.maximum(disparity, step))


def _smooth(shape: tuple[int, int], cells: int, rng: np.random.Generator) -> np.ndarray:
    """Return a smooth random field of about unit variance with so many cells across."""
    coarse = rng.standard_normal((cells * shape[0] // shape[1] + 2, cells + 2))
    factor = (shape[0] / (coarse.shape[0] - 1), shape[1] / (coarse.shape[1] - 1))
    return ndimage.zoom(coarse, factor, order=1)[: shape[0], : shape[1]]
