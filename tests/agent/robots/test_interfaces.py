"""Goals have the names, units and clocks of their drivers."""

import numpy as np

from agent.robots.interfaces import KinovaRos, Ros2Kortex
from agent.robots.trajectory import Grip
from tests.agent.robots.conftest import way

NAMES = tuple(f"j{k}" for k in range(7))


def test_velocities_that_kinova_ros_plays_back_arrive_at_the_goal():
    motion = way(1.0)
    goal = KinovaRos("left").arm_goal(NAMES, motion)["trajectory"]
    times = [each["time_from_start"]["secs"] + 1e-9 * each["time_from_start"]["nsecs"] for each in goal["points"]]
    played = sum(
        np.array(point["velocities"]) * (after - before)
        for point, before, after in zip(goal["points"][1:], times, times[1:])
    )
    assert np.allclose(motion.start + played, motion.goal, atol=1e-4)
    assert goal["joint_names"] == list(NAMES) and np.allclose(times, motion.times)
    assert goal["points"][-2]["velocities"] == goal["points"][-1]["velocities"]  # it plays the last but one twice


def test_the_fingers_of_the_jaco_are_told_in_turns_from_open_to_closed():
    goal = KinovaRos("left").hand_goal(Grip("close hand", np.radians((0.0, 40.0, 90.0))))
    assert goal == {"fingers": {"finger1": 0.0, "finger2": 3400.0, "finger3": 6800.0}}


def test_ros_2_has_its_own_clock_and_gripper():
    kortex = Ros2Kortex(effort=40.0)
    points = kortex.arm_goal(NAMES, way(1.5))["trajectory"]["points"]
    assert points[-1]["time_from_start"] == {"sec": 1, "nanosec": 500_000_000}
    assert not any(points[0]["velocities"]) and not any(points[-1]["velocities"])
    grip = Grip("close hand", np.array([0.4]))
    assert kortex.hand_goal(grip) == {"command": {"position": 0.4, "max_effort": 40.0}}
    jazzy = Ros2Kortex(effort=40.0, parallel=True)
    assert jazzy.hand.type.endswith("/ParallelGripperCommand") and kortex.hand.type.endswith("/GripperCommand")
    assert jazzy.hand_goal(grip)["command"]["position"] == [0.4]
    assert jazzy.hand_goal(grip)["command"]["name"] == ["robotiq_85_left_knuckle_joint"]
