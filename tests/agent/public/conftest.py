"""Clouds as a stranger would bring them: boxes seen from above and from the front, in metres, in the world frame."""

import numpy as np
import pytest


def box_cloud(
    x: float, y: float, side: float = 0.05, height: float = 0.08, points: int = 600, seed: int = 0
) -> np.ndarray:
    """(P, 3) float64: the top and the front of a box that stands at (x, y)."""
    rng = np.random.default_rng([seed, int(1000 * x), int(1000 * (y + 10))])
    top = rng.uniform(-0.5, 0.5, (points // 2, 3)) * (side, side, 0.0) + (0.0, 0.0, height)
    front = rng.uniform(-0.5, 0.5, (points - points // 2, 3)) * (0.0, side, height) + (-side / 2, 0.0, height / 2)
    return np.concatenate((top, front)) + (x, y, 0.0) + rng.normal(0.0, 0.0005, (points, 3))


PLACES = ((0.30, -0.30), (0.45, -0.10), (0.60, 0.05), (0.35, 0.25), (0.55, 0.35), (0.62, -0.30))


@pytest.fixture
def clouds() -> list[np.ndarray]:
    """Four boxes."""
    return [box_cloud(x, y) for x, y in PLACES[:4]]
