"""What several tests of objects need: drops in the tabletop world, and a cache of their own."""

import math

import numpy as np
import pytest

from structdiffusion.geometry import pose_from_xyz_yaw, tilt_between
from structdiffusion.simulation.world import TabletopWorld


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def drop():
    """A function that drops a model by `height` metres and gives its tilt, degrees, after `seconds`."""

    def run(model, height, seconds):
        with TabletopWorld([model], [pose_from_xyz_yaw(0.45, 0.0, height, 0.0)]) as world:
            world.step(seconds)
            return math.degrees(tilt_between(world.poses()[0], np.eye(4)))

    return run
