"""Fit a circle to places seen from above."""

from __future__ import annotations

import numpy as np


def circle_through(places: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the middle (2,) and the radius of the least-squares circle through places (P, 2), metres.

    The radius is 0 where the places lie on a line.
    """
    middle = places.mean(axis=0)
    off = places - middle
    # |p|^2 = 2 c . p + (r^2 - |c|^2) is linear in the middle c.
    terms = np.column_stack((2 * off, np.ones(len(off))))
    (x, y, rest), _, rank, _ = np.linalg.lstsq(terms, (off**2).sum(axis=1), rcond=None)
    radius = 0.0 if rank < 3 else float(np.sqrt(max(rest + x * x + y * y, 0.0)))
    return middle + (x, y), radius
