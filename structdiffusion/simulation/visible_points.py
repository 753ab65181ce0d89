"""The points that a camera sees of one object."""

from __future__ import annotations

import numpy as np

from structdiffusion.objects.model import SURFACE_POINTS
from structdiffusion.simulation.depth_camera import CameraImage

MIN_POINTS = 20  # fewer tell nothing of an object's shape


class ObservationError(ValueError):
    """An object that the camera cannot see well enough; the message names it."""


def visible_points(
    image: CameraImage, body: int, rng: np.random.Generator, min_points: int = MIN_POINTS
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return points (P, 3) float32 of one body, world frame, metres, and their colours (P, 3); `None` where it is hidden.

    Args:
        image: with the PyBullet body id of every pixel.
        body: the id.
        rng: draws 1024 of the points where there are more.
        min_points: how many points make it visible.
    """
    rows, columns = np.nonzero((image.segmentation == body) & np.isfinite(image.depth))
    if len(rows) < max(1, min_points):
        return None
    if len(rows) > SURFACE_POINTS:
        chosen = rng.choice(len(rows), SURFACE_POINTS, replace=False)
        rows, columns = rows[chosen], columns[chosen]
    return image.points[rows, columns].astype(np.float32), image.color[rows, columns]
