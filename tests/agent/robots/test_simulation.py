"""The simulated arm is moved by the same interface, in the time of its physics."""

import numpy as np
import pytest

from agent.arm.simulated_arm import SimulatedArm
from agent.errors import RobotRefused, RobotStopped
from agent.robots.limits import JointLimits
from agent.robots.robot import Robot
from agent.robots.simulation import SimulatedLink
from agent.robots.trajectory import Grip
from structdiffusion.observation import Table
from structdiffusion.simulation.world import TabletopWorld
from tests.agent.robots.conftest import MODEL, way


@pytest.fixture
def arm():
    """The arm in an empty world, and its link."""
    world = TabletopWorld((), np.zeros((0, 4, 4)), Table())
    arm = SimulatedArm(world.client)
    yield arm, SimulatedLink(world, arm)
    world.close()


def test_it_follows_grips_and_opens(arm):
    body, link = arm
    with Robot(link, JointLimits.of_arm(MODEL)) as robot:
        robot.connect()
        with pytest.raises(RobotRefused, match="approved"):
            robot.follow(way(1.0))
        robot.approve()
        robot.follow(way(1.0))
        assert np.abs(body.configuration() - way(1.0).goal).max() < 0.02
        assert np.abs(robot.grip(Grip("close hand", np.full(3, 0.8))) - 0.8).max() < 0.05
        assert np.abs(robot.grip(Grip("open hand", np.full(3, 0.2))) - 0.2).max() < 0.05


def test_an_arm_that_is_held_back_is_stopped(arm):
    body, link = arm
    with Robot(link, JointLimits.of_arm(MODEL)) as robot:
        robot.connect()
        robot.approve()
        body.command = lambda q: None  # its motors hear nothing
        with pytest.raises(RobotStopped, match="joint_1 is at 1.571 rad, .*off its path.*the arm stands still"):
            robot.follow(way(2.0, 0.9))
