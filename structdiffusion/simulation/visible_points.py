"""Extract the points of one object from a camera picture."""

from __future__ import annotations

import numpy as np

from structdiffusion.objects.model import SURFACE_POINTS
from structdiffusion.simulation.depth_camera import CameraImage

MIN_POINTS = 20  # fewer points do not show an object's shape


class ObservationError(ValueError):
    """An object that the camera does not see well enough; the message names it."""


def visible_points(
    image: CameraImage, body: int, rng: np.random.Generator, min_points: int = MIN_POINTS
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return points (P, 3) float32 of one body, world frame, metres, and their colours (P, 3); `None` if it is hidden.

    Args:
        image: with the PyBullet body id of every pixel.
        body: the id.
        rng: draws 1024 of the points if there are more.
        min_points: the number of points below which it counts as hidden.
    """
    rows, columns = np.nonzero((image.segmentation == body) & np.isfinite(image.depth))
    if len(rows) < max(1, min_points):
        return None
    if len(rows) > SURFACE_POINTS:
        chosen = rng.choice(len(rows), SURFACE_POINTS, replace=False)
        rows, columns = rows[chosen], columns[chosen]
    return image.points[rows, columns].astype(np.float32), image.color[rows, columns]
