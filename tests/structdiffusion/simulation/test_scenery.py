"""What pictures show around a table: in the right place, behind what is nearer, and no part of what is measured."""

import numpy as np
import pytest

from structdiffusion.observation import Table
from structdiffusion.simulation.depth_camera import DepthCamera
from structdiffusion.simulation.scenery import FLOOR, backdrop

TOP = DepthCamera(eye=(0.0, 0.0, 2.0), target=(0.0, 0.0, 0.0), up=(1.0, 0.0, 0.0), width=64, height=48)
TABLE = Table()


def test_floor_and_pedestal_are_as_far_away_as_they_are():
    painted = backdrop(TOP, TABLE, (0.0, 0.0, 0.0))
    assert painted.depth[24, 32] == pytest.approx(2.0, abs=1e-4)  # the pedestal's top
    assert painted.depth[2, 2] == pytest.approx(2.0 - FLOOR, abs=1e-4)
    column, row = TOP.pixels(np.array((0.0, 0.11, 0.0)))
    assert painted.depth[24, int(column) + 2] == pytest.approx(2.0, abs=1e-4)
    assert painted.depth[24, int(column) - 2] == pytest.approx(2.0 - FLOOR, abs=1e-4)


@pytest.mark.parametrize("base", [None, (0.4, 0.0, 0.0)])
def test_an_arm_on_the_table_needs_no_pedestal(base):
    assert backdrop(TOP, TABLE, base).depth[24, 32] == pytest.approx(2.0 - FLOOR, abs=1e-4)


def test_what_is_nearer_hides_the_backdrop():
    painted = backdrop(TOP, TABLE, (0.0, 0.0, 0.0))
    depth = np.full(painted.depth.shape, np.nan)
    depth[24, 32], depth[2, 2] = 1.9, 2.0 - FLOOR + 0.1  # above the pedestal, and below the floor
    white = np.full((*depth.shape, 3), 255, np.uint8)
    picture = painted.behind(white, depth)
    assert (picture[24, 32] == 255).all()
    assert (picture[2, 2] == painted.color[2, 2]).all() and (picture[0, 0] == painted.color[0, 0]).all()
