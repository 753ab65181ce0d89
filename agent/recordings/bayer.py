"""Turn the picture of a colour sensor with a Bayer mosaic into colours."""

from __future__ import annotations

import numpy as np

# Where red and blue stand in each square of two by two pixels: (row, column); green has the other two.
MOSAICS = {
    "bayer_rggb": ((0, 0), (1, 1)),
    "bayer_bggr": ((1, 1), (0, 0)),
    "bayer_gbrg": ((1, 0), (0, 1)),
    "bayer_grbg": ((0, 1), (1, 0)),
}


def colors_of_mosaic(mosaic: np.ndarray, name: str) -> np.ndarray:
    """Return the colours (H, W, 3), float32, of a mosaic (H, W); each is the mean of its nearest neighbours.

    Args:
        mosaic: the brightness that each pixel measured behind its filter.
        name: a key of `MOSAICS`.
    """
    height, width = mosaic.shape
    red, blue = np.zeros((2, height, width), bool)
    for mask, (row, column) in zip((red, blue), MOSAICS[name], strict=True):
        mask[row::2, column::2] = True
    channels = []
    for mask in (red, ~(red | blue), blue):
        # Weights 4, 2, 1 take what stands next to a pixel before what stands at its corners, as far as it is there:
        # bilinear interpolation, which ends correctly at the borders too.
        total = _weighed(np.where(mask, mosaic, 0).astype(np.float32))
        channels.append(np.where(mask, mosaic, total / np.maximum(_weighed(mask.astype(np.float32)), 1.0)))
    return np.stack(channels, axis=-1).astype(np.float32)


def _weighed(values: np.ndarray) -> np.ndarray:
    """Return the sum of each pixel and its eight neighbours, weighed with 4, 2 at the sides and 1 at the corners."""
    padded = np.pad(values, 1)
    rows = padded[:-2] + 2 * padded[1:-1] + padded[2:]
    return rows[:, :-2] + 2 * rows[:, 1:-1] + rows[:, 2:]
