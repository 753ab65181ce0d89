"""Arms behind a rosbridge server, and the motions that tests ask them for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np
import pytest

from agent.arm.arm_model import DEFAULT_MODEL, arm_model
from agent.robots.interfaces import Interface, KinovaRos, Ros2Kortex
from agent.robots.limits import JointLimits
from agent.robots.robot import Robot
from agent.robots.rosbridge import RosbridgeLink
from agent.robots.trajectory import Trajectory
from agent.robots.watch import Tolerances
from tests.agent.robots.rosbridge_server import RosbridgeServer, StandInArm, running

MODEL = arm_model(DEFAULT_MODEL)
# A busy machine delays both sides: where a test is not about delays, none is too long.
PATIENT = Tolerances(lag=60.0, lead=60.0, stale=60.0, late=60.0, settle=60.0, stopping=60.0)


@dataclass(frozen=True, eq=False)
class Cell:
    """An arm behind its server, and the robot that is connected to it."""

    arm: StandInArm
    server: RosbridgeServer
    robot: Robot
    limits: JointLimits


def way(seconds: float, radians: float = 0.3, purpose: str = "reach") -> Trajectory:
    """Return a motion of the first joint, from the waiting pose."""
    shares = np.linspace(0.0, 1.0, 11)
    positions = MODEL.folded + shares[:, None] * np.where(np.arange(len(MODEL.joints)) == 0, radians, 0.0)
    return Trajectory(purpose, seconds * shares, positions)


def interface_of(ros: int) -> tuple[Interface, JointLimits]:
    """Return the interface of a driver, and the joints as it names them."""
    if ros == 1:
        return KinovaRos(DEFAULT_MODEL), JointLimits.of_arm(MODEL, f"{DEFAULT_MODEL}_")
    return Ros2Kortex(), JointLimits.of_arm(MODEL)


@pytest.fixture(params=(1, 2), ids=("ros1", "ros2"))
def ros(request: pytest.FixtureRequest) -> int:
    """The version of ROS."""
    return int(request.param)


@pytest.fixture
def cell(ros: int) -> Iterator[Callable[..., Cell]]:
    """Return a function that sets up an arm with a fault; its robot is connected unless told otherwise."""
    with ExitStack() as ends:

        def set_up(
            fault: str = "",
            tolerances: Tolerances = PATIENT,
            link: type[RosbridgeLink] = RosbridgeLink,
            connected: bool = True,
        ) -> Cell:
            interface, limits = interface_of(ros)
            arm = StandInArm(limits.names, MODEL.folded, limits.fingers)
            arm.fault = fault
            server, address = ends.enter_context(running(interface, arm))
            robot = ends.enter_context(Robot(link(address, interface, limits.names), limits, tolerances=tolerances))
            if connected:
                robot.connect()
            return Cell(arm, server, robot, limits)

        yield set_up
