"""What counts as standing as placed: near the place, upright, on what it was to rest on."""

import math

import numpy as np
import pytest

from structdiffusion.geometry import pose_from_xyz_rpy, pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.protocol.standing import standing, support_name
from structdiffusion.simulation.world import TABLE, TabletopWorld

BLOCKS = [procedural_object("block", index) for index in range(2)]
TOP = BLOCKS[0].height


@pytest.mark.parametrize(
    ("pose", "stands", "trouble"),
    [
        (pose_from_xyz_yaw(0.4, 0.0, TOP, 2.0), True, ""),  # turned about its axis: the protocol allows that
        (pose_from_xyz_yaw(0.43, 0.0, TOP, 0.0), True, ""),
        (pose_from_xyz_yaw(0.45, 0.0, TOP, 0.0), False, "is 5.0 cm from its place"),
        (pose_from_xyz_rpy((0.4, 0.0, TOP), (math.pi / 2, 0.0, 0.0)), False, "lies 90 degrees off"),
        (pose_from_xyz_rpy((0.5, 0.0, 0.0), (0.0, math.radians(20), 0.0)), False,
         "lies 20 degrees off and is 10.0 cm from its place"),
        (pose_from_xyz_yaw(0.4, 0.0, TOP + 0.1, 0.0), False, "does not rest on block 1"),
        (pose_from_xyz_yaw(0.4, 0.0, -0.5, 0.0), False, "has fallen off the table"),
    ],
)  # fmt: skip
def test_standing_on_a_block(pose, stands, trouble):
    goal = pose_from_xyz_yaw(0.4, 0.0, TOP + 0.004, 0.0)
    with TabletopWorld(BLOCKS, [pose_from_xyz_yaw(0.4, 0.0, 0.0, 0.0), pose]) as world:
        found = standing(world, 1, goal, 0)
        assert found.stands == stands and found.trouble(support_name(0, ["block 1", "block 2"])) == trouble
        np.testing.assert_array_equal(world.pose(1)[:3, 3].round(6), pose[:3, 3].round(6))


def test_beside_its_support_on_the_table_is_not_on_it():
    with TabletopWorld(BLOCKS, [pose_from_xyz_yaw(0.2, 0.0, 0.0, 0.0), pose_from_xyz_yaw(0.4, 0.0, 0.0, 0.0)]) as world:
        goal = pose_from_xyz_yaw(0.4, 0.0, TOP, 0.0)
        assert standing(world, 1, goal, 0).trouble("block 1") == "does not rest on block 1"
        assert standing(world, 1, goal).stands  # what it was to rest on is not known
        assert standing(world, 1, pose_from_xyz_yaw(0.4, 0.0, 0.0, 0.0), TABLE).stands
