"""Cut an object out of the camera's picture for the network."""

from __future__ import annotations

import numpy as np
from PIL import Image
from scipy import ndimage

from agent.perception.nouns.efficientnet_lite import SIDE

GRAY = 127  # of what is not the object: zero for the network
_GROWN = 2  # pixels by which the object is grown, because depth ends before the picture's edges do


def object_crop(picture: np.ndarray, mask: np.ndarray, margin: float) -> np.ndarray:
    """Return the square (224, 224, 3) uint8 around an object, everything else in it gray.

    Args:
        picture: (H, W, 3) uint8 RGB.
        mask: (H, W) bool, the object's pixels; at least one.
        margin: the square's side, as a multiple of the object's longer side.
    """
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    side = max(rows[-1] - rows[0], columns[-1] - columns[0]) + 1
    half = int(np.ceil(side * margin / 2))
    row, column = (rows[0] + rows[-1] + 1) // 2, (columns[0] + columns[-1] + 1) // 2
    # Cut out first: the work below is for the object's part of the picture only.
    top, left = max(0, row - half), max(0, column - half)
    part = np.s_[top : row + half, left : column + half]
    own = ndimage.binary_fill_holes(np.pad(mask[part], _GROWN))
    own = ndimage.binary_dilation(own, iterations=_GROWN)[_GROWN:-_GROWN, _GROWN:-_GROWN]
    square = np.full((2 * half, 2 * half, 3), GRAY, np.uint8)
    place = np.s_[top - row + half :, left - column + half :]
    square[place][: own.shape[0], : own.shape[1]][own] = picture[part][own]
    return np.asarray(Image.fromarray(square).resize((SIDE, SIDE), Image.Resampling.BICUBIC))
