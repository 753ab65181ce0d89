"""Simulate the depth pictures of three cameras, with the errors that make segmentation hard.

A pattern projector or a second camera beside the first leaves shadows without depth; depth comes in steps of disparity;
at the edges of near surfaces it is fattened or lies between both surfaces; steep, dark and shiny surfaces have holes;
and the whole picture is bent by waves of a few millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

_STEEP = 0.22  # cosine of the angle of view below which a surface is often lost
_SPECKLE = 3.0  # pixels across the patches in which fattening and holes occur
_WAVELENGTH = 45.0  # pixels


@dataclass(frozen=True)
class DepthSensor:
    """A depth camera with 640 x 480 pixels.

    Attributes:
        name: of the camera.
        focal: pixels.
        baseline: metres between the two eyes, the other one to the right.
        step: pixels of disparity between two measurable depths.
        noise: pixels of disparity, standard deviation.
        correlation: pixels across which that noise is alike.
        waves: relative standard deviation of slow errors over the picture.
        fattening: pixels by which near surfaces grow at their edges, at most.
        flying: share of edge pixels that lie between the two surfaces.
        lost: share of steep, dark or shiny surfaces without depth.
    """

    name: str
    focal: float
    baseline: float
    step: float
    noise: float
    correlation: float
    waves: float
    fattening: int
    flying: float
    lost: float


SENSORS = (
    DepthSensor("RealSense D435", 615.0, 0.050, 1 / 32, 0.09, 1.8, 0.0015, 3, 0.5, 0.3),
    DepthSensor("Kinect v1", 525.0, 0.075, 1 / 8, 0.05, 0.8, 0.0010, 2, 0.25, 0.35),
    DepthSensor("Xtion", 570.0, 0.075, 1 / 8, 0.07, 1.0, 0.0014, 2, 0.3, 0.3),
)


def measured(
    depth: np.ndarray,
    cosine: np.ndarray,
    shadow: np.ndarray,
    dark: np.ndarray,
    sensor: DepthSensor,
    rng: np.random.Generator,
) -> np.ndarray:
    """Return the depth (H, W) that a sensor measures, metres, NaN where it measures nothing.

    Args:
        depth: (H, W) the true depth, metres; infinite where there is nothing.
        cosine: (H, W) of the angle between the surface's normal and the line of sight.
        shadow: (H, W) pixels that the other eye does not see.
        dark: (H, W) pixels of dark or shiny surfaces.
        sensor: the camera.
        rng: the only source of randomness.
    """
    shape = depth.shape
    seen = np.where(np.isfinite(depth), depth, 10.0)
    seen = fattened(seen, sensor, rng)
    seen = flying(seen, sensor, rng)
    disparity = sensor.focal * sensor.baseline / seen
    noise = ndimage.gaussian_filter(rng.standard_normal(shape), sensor.correlation)
    disparity += sensor.noise * noise / noise.std()
    waves = ndimage.gaussian_filter(rng.standard_normal(shape), _WAVELENGTH)
    disparity *= 1.0 + sensor.waves * waves / waves.std()
    disparity = np.round(disparity / sensor.step) * sensor.step
    patches = ndimage.gaussian_filter(rng.standard_normal(shape), _SPECKLE)
    patches = patches > np.quantile(patches, 1.0 - sensor.lost)
    holes = shadow | (patches & (dark | (cosine < _STEEP))) | ~np.isfinite(depth) | (seen > 5.0)
    return np.where(holes, np.nan, sensor.focal * sensor.baseline / np.maximum(disparity, sensor.step))


def shadowed(depth: np.ndarray, sensor: DepthSensor) -> np.ndarray:
    """Return the pixels (H, W) that the sensor's other eye does not see, from the true depth (H, W), metres.

    In that eye's picture, a surface moves to the left by its disparity; what comes to lie to the right of something
    that was on its own right is behind it.
    """
    places = np.arange(depth.shape[1]) - sensor.focal * sensor.baseline / depth
    leftmost = np.minimum.accumulate(places[:, ::-1], axis=1)[:, ::-1]
    return np.pad(places[:, :-1] > leftmost[:, 1:] + 0.5, ((0, 0), (0, 1)))


def facing(depth: np.ndarray, focal: float) -> np.ndarray:
    """Return the cosine (H, W) of the angle between the surface's normal and the line of sight, from the true depth.

    Args:
        depth: (H, W) metres, finite.
        focal: pixels; the axis goes through the middle of the picture.
    """
    height, width = depth.shape
    x = (np.arange(width) + 0.5 - width / 2)[None, :] / focal
    y = (np.arange(height) + 0.5 - height / 2)[:, None] / focal
    right, down = _slope(depth, 1), _slope(depth, 0)
    across = np.stack((depth / focal + x * right, y * right, right), axis=-1)
    along = np.stack((x * down, depth / focal + y * down, down), axis=-1)
    normal = np.cross(across, along)
    sight = np.stack(np.broadcast_arrays(x, y, np.ones_like(depth)), axis=-1)
    lengths = np.linalg.norm(normal, axis=-1) * np.linalg.norm(sight, axis=-1)
    return np.abs((normal * sight).sum(axis=-1)) / np.maximum(lengths, 1e-12)


def _slope(depth: np.ndarray, axis: int) -> np.ndarray:
    """Return the change of depth per pixel, toward the neighbour whose depth differs less: edges belong to neither
    side.
    """
    step = np.diff(depth, axis=axis)
    edge = np.take(step, [0], axis=axis), np.take(step, [-1], axis=axis)
    behind, ahead = np.concatenate((edge[0], step), axis=axis), np.concatenate((step, edge[1]), axis=axis)
    return np.where(np.abs(behind) < np.abs(ahead), behind, ahead)


def fattened(depth: np.ndarray, sensor: DepthSensor, rng: np.random.Generator) -> np.ndarray:
    """Grow near surfaces over far ones by a width that varies along their edges."""
    wide = ndimage.gaussian_filter(rng.random(depth.shape), 2 * _SPECKLE)
    rank = (wide - wide.min()) / np.ptp(wide)
    grown = depth
    for width in range(1, sensor.fattening + 1):
        near = ndimage.minimum_filter(depth, 2 * width + 1)
        edge = (near < depth * 0.975) & (rank > width / (sensor.fattening + 1))
        grown = np.where(edge, near, grown)
    return grown


def flying(depth: np.ndarray, sensor: DepthSensor, rng: np.random.Generator) -> np.ndarray:
    """Set some pixels at edges between the two surfaces."""
    near, far = ndimage.minimum_filter(depth, 3), ndimage.maximum_filter(depth, 3)
    edge = (far > 1.02 * near) & (rng.random(depth.shape) < sensor.flying)
    share = rng.random(depth.shape)
    return np.where(edge, near + share * (np.minimum(far, near + 0.3) - near), depth)
