"""Convert colours to CIELAB, and measure how much each point's colour differs from the table around it."""

from __future__ import annotations

import numpy as np

from structdiffusion.geometry import lengths

_WINDOW = 61  # pixels across the table's colour about a pixel: lamps and grain change it slowly
_LEAST = 1.5  # standard deviation in CIELAB of a table in one colour: what a camera's own noise is
_TYPICAL = 0.8  # of the points taken for the table's are the table's for sure; the others are plates, stains, feet
_MAIN = 4.0  # of the standard deviations of those: what is farther away is another colour
_SHADES = 30.0  # apart in CIELAB at most: one colour in light and shade
_RGB_TO_XYZ = np.array(
    [[0.4124564, 0.2126729, 0.0193339], [0.3575761, 0.7151522, 0.1191920], [0.1804375, 0.0721750, 0.9503041]],
    dtype=np.float32,
)
_DAYLIGHT = np.array([0.95047, 1.0, 1.08883], dtype=np.float32)


def lab(colors: np.ndarray) -> np.ndarray:
    """Return CIELAB (P, 3) float32 of sRGB colours (P, 3) uint8, under daylight."""
    return lab_of_linear(linear(colors))


def linear(colors: np.ndarray) -> np.ndarray:
    """Return linear red, green and blue (P, 3) float32, 0 to 1, of sRGB colours (P, 3) uint8."""
    level = np.arange(256) / 255.0
    return np.where(level > 0.04045, ((level + 0.055) / 1.055) ** 2.4, level / 12.92).astype(np.float32)[colors]


def lab_of_linear(values: np.ndarray) -> np.ndarray:
    """Return CIELAB (P, 3) float32 of linear red, green and blue (P, 3), under daylight."""
    ratio = values @ _RGB_TO_XYZ / _DAYLIGHT
    root = np.where(ratio > 0.008856, np.cbrt(ratio), 7.787 * ratio + 16 / 116)
    return np.stack((116 * root[:, 1] - 16, 500 * (root[:, 0] - root[:, 1]), 200 * (root[:, 1] - root[:, 2])), axis=1)


def differ(lab: np.ndarray | None, one: np.ndarray, other: np.ndarray) -> bool:
    """Return whether two sets of points have different colours, by their medians; never where no colour is known.

    Args:
        lab: (P, 3) in CIELAB, or `None`.
        one, other: (P,) bool, or indices.
    """
    if lab is None:
        return False
    return bool(np.linalg.norm(np.median(lab[one], axis=0) - np.median(lab[other], axis=0)) > _SHADES)


def contrast(colors: np.ndarray, table: np.ndarray, pixels: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return by how many standard deviations of the table's colour each point differs from the table around it: (P,).

    Args:
        colors: (P, 3) in CIELAB.
        table: (P,) whether each point belongs to the table.
        pixels: (P,) the place of each in the flattened picture.
        shape: of the picture; of an unorganised cloud, which has one row, the whole table is about every point.
    """
    if not table.any():
        return np.zeros(len(colors))
    # Plates are flat too: what is not of the table's main colour does not show its colour.
    away = _deviations(colors - np.median(colors[table], axis=0), table)
    typical = table & (away < _MAIN)
    return _deviations(colors - _about(colors, typical, pixels, shape), typical)


def _deviations(off: np.ndarray, typical: np.ndarray) -> np.ndarray:
    """Return the Mahalanobis distance (P,) of differences (P, 3), by the scatter of the typical ones among them."""
    size = lengths(off[typical])
    covariance = np.cov(off[typical][size <= np.quantile(size, _TYPICAL)].T) + _LEAST**2 * np.eye(3)
    white = off @ np.linalg.cholesky(np.linalg.inv(covariance)).astype(np.float32)
    return lengths(white)


def _about(colors: np.ndarray, table: np.ndarray, pixels: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return the table's mean colour (P, 3) around each point."""
    whole = colors[table].mean(axis=0)
    if shape[0] == 1:
        return np.broadcast_to(whole, colors.shape)
    from scipy import ndimage  # takes as long to import as numpy, and only clouds with a table around them need it

    # A thousandth of the whole table's colour, for where none of it is near.
    weight = 1e-3
    sums = np.zeros((shape[0] * shape[1], 4), np.float32)
    sums[pixels[table], :3] = colors[table] - whole
    sums[pixels[table], 3] = 1.0
    means = [ndimage.uniform_filter(sums[:, k].reshape(shape), _WINDOW, mode="constant").ravel() for k in range(4)]
    return whole + np.stack([means[k][pixels] / (means[3][pixels] + weight) for k in range(3)], axis=1)
