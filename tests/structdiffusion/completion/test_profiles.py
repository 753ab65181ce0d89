import numpy as np

from structdiffusion.completion.profiles import profile_of


def test_a_vessel_of_which_only_the_near_side_is_seen_is_as_deep_as_can_be():
    """Its floor is not known, and no point of the far side tells it."""
    rng = np.random.default_rng(0)
    angles, outwards = rng.uniform(-0.9, 0.9, 400), rng.uniform(0.0, 0.02, 400)
    radii = 0.06 + outwards
    near = np.column_stack((radii * np.cos(angles), radii * np.sin(angles), 0.02 + 3 * outwards))
    body = profile_of(near, np.array([1.0, 0.0, 0.5]), np.zeros(2), 0.0)
    assert body.hollow and body.inner[0, 1] <= 0.002 and body.inner[:, 1].max() > 0.07
