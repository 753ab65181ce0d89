"""Decide which level surfaces are parts of one table: what stands on it may hide a strip from one side to the other.

Two parts belong together unless something below the table is seen between them, as the floor is between two tables.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

CELL = 0.02  # m, of the grid in which the table's surface is described
_LEAST = 25  # cells: 100 cm2
_WIDEST = 25  # cells: a gap of half a metre
_LINES = 60  # across a gap, along which is looked
_SEEN = 0.1  # of the places on those lines are seen through: the parts are apart
_BELOW = 0.05  # m: what is lower is not the table


def parts_joined(parts: np.ndarray, cells: np.ndarray, through: np.ndarray) -> np.ndarray:
    """Give the parts that belong to the largest one its number.

    Args:
        parts: (A, B) int, the part of each cell, 0 for none.
        cells: (A, B) bool, cells in which the table was seen.
        through: (A, B) bool, cells through which something below the table was seen.

    Returns:
        (A, B) int, as `parts`.
    """
    sizes = np.bincount(parts[cells], minlength=int(parts.max()) + 1)
    sizes[0] = 0
    main = int(sizes.argmax())
    parts = parts.copy()
    # A floor is not seen through every cell.
    open_below = ndimage.binary_closing(np.pad(through, 2))[2:-2, 2:-2] & ~cells
    waiting = [part for part in np.argsort(-sizes) if sizes[part] >= _LEAST and part != main]
    grown = True
    while grown:
        grown = False
        for part in list(waiting):
            if _belongs(np.argwhere(cells & (parts == part)), np.argwhere(cells & (parts == main)), open_below):
                parts[parts == part] = main
                waiting.remove(part)
                grown = True
    return parts


def seen_through(level: np.ndarray, eye: np.ndarray, low: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return the cells (A, B) of the table's plane through which something below it was seen.

    Args:
        level: (P, 3) points in the plane's frame, metres.
        eye: (3,) where the camera is.
        low: (2,) the corner of the first cell.
        shape: (A, B).
    """
    below = level[level[:, 2] < -_BELOW]
    crossing = eye[:2] + (below[:, :2] - eye[:2]) * (eye[2] / (eye[2] - below[:, 2]))[:, None]
    place = np.floor((crossing - low) / CELL).astype(int)
    place = place[((place >= 0) & (place < shape)).all(axis=1)]
    cells = np.zeros(shape, dtype=bool)
    cells[place[:, 0], place[:, 1]] = True
    return cells


def _belongs(part: np.ndarray, main: np.ndarray, open_below: np.ndarray) -> bool:
    """Return whether nothing below the table is seen between two sets of cells (K, 2)."""
    away, nearest = cKDTree(main).query(part)
    if away.min() > _WIDEST:
        return False
    near = np.flatnonzero(away <= 1.5 * away.min() + 1.0)
    near = near[:: len(near) // _LINES + 1]
    share = np.linspace(0.0, 1.0, int(2 * away[near].max()) + 2)[:, None, None]
    places = np.rint(part[near] + share * (main[nearest[near]] - part[near])).astype(int).reshape(-1, 2)
    return bool(open_below[places[:, 0], places[:, 1]].mean() < _SEEN)
