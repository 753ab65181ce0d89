"""Round tops fall off to all sides; level ones do not, and a cone's falls too fast."""

import numpy as np
import pytest

from structdiffusion.completion.tops import fall_of_top, is_rounded

R, HEIGHT = 0.035, 0.07


@pytest.fixture
def inside_a_disc():
    across = np.random.default_rng(0).uniform(-R, R, (4000, 2))
    return across[np.linalg.norm(across, axis=1) < R]


def test_a_ball_is_rounded_and_falls_by_what_geometry_says(inside_a_disc):
    off = np.linalg.norm(inside_a_disc, axis=1)
    ball = np.column_stack((inside_a_disc, R + np.sqrt(R**2 - off**2)))
    # Medians by area: of a disc of 0.35 R at 0.35 R / sqrt(2), of a ring between 0.5 and 0.7 R at 0.608 R.
    assert fall_of_top(ball) == pytest.approx(R * (np.sqrt(1 - 0.35**2 / 2) - np.sqrt(1 - 0.608**2)), rel=0.05)
    assert is_rounded(ball, HEIGHT)


@pytest.mark.parametrize("slope", [0.0, 1.0])
def test_what_is_level_or_pointed_is_not_rounded(inside_a_disc, slope):
    top = np.column_stack((inside_a_disc, HEIGHT - slope * np.linalg.norm(inside_a_disc, axis=1)))
    assert not is_rounded(top, HEIGHT)


def test_too_few_points_tell_nothing():
    assert fall_of_top(np.zeros((2, 3))) == 0.0
