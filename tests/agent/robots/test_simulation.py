"""The simulated arm is moved by the same interface, in the time of its physics."""

import numpy as np
import pytest

from agent.arm.controller import ArmDriver
from agent.arm.grasps import hand_pose
from agent.arm.simulated_arm import SimulatedArm
from agent.errors import RobotRefused, RobotStopped
from agent.robots.limits import JointLimits
from agent.robots.robot import Robot
from agent.robots.simulation import SimulatedLink
from agent.robots.trajectory import Grip
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
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


def around_a_mug():
    """Return a world with a mug, and the arm with its open hand around it."""
    mug = procedural_object("mug", 1)
    world = TabletopWorld([mug], [pose_from_xyz_yaw(0.45, 0.0, 0.0, 0.0)], Table())
    arm = SimulatedArm(world.client)
    above = hand_pose((0.45, 0.0, mug.height - 0.035 + arm.hand.tip_level), 0.0)
    arm.teleport(arm.kinematics.solve(above, np.random.default_rng(0)), [0.3] * 3)
    return world, arm


def test_it_grips_an_object_as_a_build_does():
    """The fingers wait where they touch, then press, and their tips fold; they open together, from where they are. None
    of them pushes the mug away.
    """
    world, arm = around_a_mug()
    driver = ArmDriver(world, arm)
    driver.take(driver.close(*world.bodies)[0])
    told, gripped, there = arm.finger_set_point.copy(), arm.finger_angles(), world.pose(0)
    driver.let_go(0.3)
    let_go = world.pose(0)
    world.close()
    world, arm = around_a_mug()
    with Robot(SimulatedLink(world, arm), JointLimits.of_arm(MODEL)) as robot:
        robot.connect()
        robot.approve()
        assert np.abs(robot.grip(Grip("close hand", told)) - gripped).max() < 0.01
        assert np.linalg.norm((world.pose(0) - there)[:3, 3]) < 0.001
        robot.grip(Grip("open hand", np.full(3, 0.3)))
    assert np.linalg.norm((world.pose(0) - let_go)[:3, 3]) < 0.001
    world.close()
