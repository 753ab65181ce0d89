"""The walls of open containers leave the inside free, also where the camera saw little of them."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from agent.arm.containers import WALLS, walls_of

RADIUS, HEIGHT = 0.08, 0.06


def bowl(angles: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A cylinder without a lid, 5 mm thick, seen where its wall has these angles, and its floor."""
    count = len(angles)
    radius, z = rng.uniform(RADIUS - 0.005, RADIUS, count), rng.uniform(0.0, HEIGHT, count)
    wall = np.column_stack((radius * np.cos(angles), radius * np.sin(angles), z))
    floor = np.column_stack((rng.uniform(-0.05, 0.05, (300, 2)), np.full(300, 0.004)))
    return np.concatenate((wall, floor)) + (0.4, -0.1, 0.0)


def holds(walls: list[np.ndarray], point: tuple[float, float, float]) -> bool:
    """Whether a point is inside any of the walls."""
    shifted = np.array(point) + (0.4, -0.1, 0.0)
    return any((ConvexHull(w).equations @ [*shifted, 1.0] < 1e-9).all() for w in walls)


@pytest.mark.parametrize("seen", [(-np.pi, np.pi), (-2.0, 2.0)])
def test_the_inside_is_free_and_the_wall_is_not(seen):
    rng = np.random.default_rng(0)
    walls = walls_of(bowl(rng.uniform(*seen, 6000), rng))
    assert len(walls) == WALLS
    for x, y in ((0.0, 0.0), (0.05, 0.0), (0.0, -0.05), (-0.04, 0.04)):
        assert not holds(walls, (x, y, 0.03))
    for angle in np.linspace(-3.0, 3.0, 25):
        x, y = (RADIUS - 0.0025) * np.array((np.cos(angle), np.sin(angle)))
        assert holds(walls, (x, y, 0.03)), angle
    assert not holds(walls, (RADIUS + 0.01, 0.0, 0.03))


def test_walls_reach_from_what_the_container_stands_on_to_its_rim():
    rng = np.random.default_rng(0)
    walls = walls_of(bowl(rng.uniform(-np.pi, np.pi, 6000), rng) + (0.0, 0.0, 0.1), 0.1)
    for wall in walls:
        assert wall[:, 2].min() == pytest.approx(0.1) and wall[:, 2].max() == pytest.approx(0.16, abs=0.002)
