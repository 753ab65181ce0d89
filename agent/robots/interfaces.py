"""Name the topics, actions and units of two drivers: kinova-ros (ROS 1) and ros2_kortex (ROS 2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from agent.robots.trajectory import Grip, Trajectory

CLOSED_TURNS, CLOSED_RADIANS = (
    6800.0,
    np.radians(80.0),
)  # of a finger of the Jaco, in its driver's unit and as its joint


@dataclass(frozen=True)
class ActionName:
    """An action of a driver.

    Attributes:
        name: such as "/j2s7s300/follow_joint_trajectory".
        type: of the action, such as "control_msgs/FollowJointTrajectory", without "Action".
    """

    name: str
    type: str


class Interface(Protocol):
    """The interface of one driver.

    Attributes:
        ros: 1 or 2.
        states: (topic, type) of the joint states.
        arm, hand: its actions.
        halt: the service that stops the arm whatever it does; empty if there is none.
        after_halt: what lets the arm move again, in words; empty without `halt`.
    """

    ros: int
    states: tuple[str, str]
    arm: ActionName
    hand: ActionName
    halt: str
    after_halt: str

    def arm_goal(self, names: tuple[str, ...], trajectory: Trajectory) -> dict[str, Any]:
        """Return the goal of `arm` as JSON."""

    def hand_goal(self, grip: Grip) -> dict[str, Any]:
        """Return the goal of `hand` as JSON."""


class KinovaRos:
    """kinova-ros, whose robot is called `name`, such as "j2s7s300" or "left".

    Its controller plays velocities back, each until the time of its point, and needs two points or more.
    """

    ros = 1

    def __init__(self, name: str) -> None:
        driver = f"/{name}_driver"
        self.states = (f"{driver}/out/joint_state", "sensor_msgs/JointState")
        self.arm = ActionName(f"/{name}/follow_joint_trajectory", "control_msgs/FollowJointTrajectory")
        self.hand = ActionName(f"{driver}/fingers_action/finger_positions", "kinova_msgs/SetFingersPosition")
        self.halt = f"{driver}/in/stop"
        self.after_halt = f"the service {driver}/in/start lets it move again"

    def arm_goal(self, names: tuple[str, ...], trajectory: Trajectory) -> dict[str, Any]:
        """See `Interface`."""
        points = _points(trajectory, trajectory.mean_velocities(), ("secs", "nsecs"))
        header = {"stamp": {"secs": 0, "nsecs": 0}, "frame_id": ""}
        return {"trajectory": {"header": header, "joint_names": list(names), "points": points}}

    def hand_goal(self, grip: Grip) -> dict[str, Any]:
        """See `Interface`; turns from 0 (open) to 6800 (closed)."""
        turns = np.clip(grip.angles * (CLOSED_TURNS / CLOSED_RADIANS), 0.0, CLOSED_TURNS).round(1)
        return {"fingers": {f"finger{k}": float(each) for k, each in enumerate(turns, start=1)}}


class Ros2Kortex:
    """ros2_kortex with a Robotiq gripper; its controllers are those of ros2_control.

    Args:
        effort: N, of the gripper.
        parallel: whether the gripper's action is ParallelGripperCommand (ROS 2 Jazzy), or GripperCommand (Humble).
        knuckle: the gripper's joint.
    """

    ros = 2
    states: tuple[str, str] = ("/joint_states", "sensor_msgs/msg/JointState")
    arm = ActionName(
        "/joint_trajectory_controller/follow_joint_trajectory", "control_msgs/action/FollowJointTrajectory"
    )
    halt = after_halt = ""

    def __init__(
        self, effort: float = 100.0, parallel: bool = False, knuckle: str = "robotiq_85_left_knuckle_joint"
    ) -> None:
        kind = "ParallelGripperCommand" if parallel else "GripperCommand"
        self.hand = ActionName("/robotiq_gripper_controller/gripper_cmd", f"control_msgs/action/{kind}")
        self.effort, self.parallel, self.knuckle = effort, parallel, knuckle

    def arm_goal(self, names: tuple[str, ...], trajectory: Trajectory) -> dict[str, Any]:
        """See `Interface`."""
        points = _points(trajectory, trajectory.velocities(), ("sec", "nanosec"))
        header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
        return {"trajectory": {"header": header, "joint_names": list(names), "points": points}}

    def hand_goal(self, grip: Grip) -> dict[str, Any]:
        """See `Interface`; one angle, rad, as the knuckle's joint."""
        angle = float(grip.angles[0])
        if self.parallel:
            return {"command": {"name": [self.knuckle], "position": [angle], "velocity": [], "effort": [self.effort]}}
        return {"command": {"position": angle, "max_effort": self.effort}}


def _points(trajectory: Trajectory, velocities: np.ndarray, clock: tuple[str, str]) -> list[dict[str, Any]]:
    points = []
    for time, position, velocity in zip(trajectory.times, trajectory.positions, velocities, strict=True):
        seconds, nanoseconds = divmod(round(float(time) * 1e9), 10**9)
        points.append(
            {
                "positions": position.round(6).tolist(),
                "velocities": velocity.round(6).tolist(),
                "accelerations": [],
                "effort": [],
                "time_from_start": {clock[0]: seconds, clock[1]: nanoseconds},
            }
        )
    return points
