"""What pictures show around a table: in the right place, behind what is nearer, and no part of what is measured."""

import numpy as np
import pytest

from structdiffusion.observation import Table
from structdiffusion.simulation.depth_camera import VIEWS, DepthCamera
from structdiffusion.simulation.scenery import FLOOR, backdrop
from structdiffusion.simulation.world import TabletopWorld

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


def test_what_is_nearer_hides_the_backdrop_and_nothing_else_changes():
    lens = VIEWS["shoulder"]
    with TabletopWorld() as world:
        plain, seen = world.picture("shoulder"), world.look()
        painted = world.picture("shoulder", backdrop=backdrop(lens, world.ground, (0.0, 0.0, 0.0)))
        again = world.look()
    column, row = lens.pixels(np.array((0.45, 0.0, 0.0))).astype(int)
    assert (painted[row, column] == plain[row, column]).all()
    assert (plain[-1, -1] == 255).all() and (painted[-1, -1] < 245).all()
    assert (seen.color == again.color).all() and (seen.segmentation == again.segmentation).all()
    assert not np.isfinite(again.depth[0, 0])  # the depth camera sees no floor
