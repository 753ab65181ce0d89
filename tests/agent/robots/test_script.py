"""The motions of the twin become steps; whether something is in the hand is known from the fingers."""

import numpy as np
import pytest

from agent.errors import RobotRefused, RobotStopped
from agent.recordings.trajectory_export import Motion
from agent.robots.script import carry_out, steps_of
from agent.robots.trajectory import Grip, Trajectory
from tests.agent.robots.conftest import MODEL, way

OPEN, CLOSED = np.full(3, 0.2), np.full(3, 1.2)


def motion(name, joints, fingers, moved_fingers):
    """Return a motion of two points."""
    joints, fingers = np.array(joints), np.array(fingers)
    moved = np.concatenate((joints, np.array(moved_fingers)), axis=1)
    return Motion(name, 0.0, np.array([0.0, 1.0]), joints, fingers, moved)


def motions(held):
    """Return a pick whose fingers stay `held` rad behind."""
    here, there = way(1.0).start, way(1.0).goal
    return [
        motion("open hand", (here, here), (CLOSED, OPEN), (CLOSED, CLOSED)),  # is told, and not waited for
        motion("reach", (here, there), (OPEN, OPEN), (OPEN, OPEN)),
        motion("close hand", (there, there), (OPEN, CLOSED), (OPEN, CLOSED - held)),
        motion("rest", (there, there), (CLOSED, CLOSED), (CLOSED - held, CLOSED - held)),
        motion("lift", (there, here), (CLOSED, CLOSED), (CLOSED - held, CLOSED - held)),
    ]


def test_what_rests_is_left_out_and_what_is_held_is_known():
    steps = steps_of(motions(0.15), closed=1.5)
    assert [step.motion.purpose for step in steps] == ["open hand", "reach", "close hand", "lift"]
    assert [type(step.motion) for step in steps] == [Grip, Trajectory, Grip, Trajectory]
    assert [step.holds.all() for step in steps] == [False, False, True, False]
    assert not any(step.holds.any() for step in steps_of(motions(0.0), closed=1.5))
    assert not any(step.holds.any() for step in steps_of(motions(0.15), closed=1.0))  # the real finger stops there
    assert steps_of([], closed=1.5) == ()


def test_of_a_hand_with_one_drive_one_finger_is_asked_for():
    steps = steps_of(motions(np.array([0.15, 0.0, 0.0])), closed=1.5, drives=1)
    grips = [step for step in steps if isinstance(step.motion, Grip)]
    assert [step.motion.angles.tolist() for step in grips] == [[0.2], [1.2]]
    assert [step.lag.round(3).tolist() for step in grips] == [[0.0], [0.15]]


def approved(cell, thing):
    here = cell()
    here.arm.thing = thing
    here.arm.positions |= dict.fromkeys(here.arm.fingers, 1.0)
    here.robot.approve()
    return here


def test_all_steps_are_carried_out_in_order(cell):
    here = approved(cell, thing=0.15)
    steps = steps_of(motions(0.15), closed=1.5)
    assert list(carry_out(here.robot, steps)) == list(steps)
    assert np.abs(here.robot.state()[0] - MODEL.folded).max() < 1e-3


def test_an_empty_hand_is_noticed_before_anything_is_lifted(cell):
    here = approved(cell, thing=0.0)
    begun = []
    with pytest.raises(RobotStopped, match="close hand: nothing seems to be in the hand"):
        begun += (step.motion.purpose for step in carry_out(here.robot, steps_of(motions(0.15), closed=1.5)))
    assert begun == ["open hand", "reach", "close hand"]
    with pytest.raises(RobotRefused, match="approved"):
        here.robot.follow(way(1.0))


def test_an_arm_that_was_moved_between_two_steps_is_stopped(cell):
    here = approved(cell, thing=0.15)
    work = carry_out(here.robot, steps_of(motions(0.15), closed=1.5))
    with pytest.raises(RobotStopped, match="lift: the arm is not where the motion begins"):
        for step in work:
            if step.motion.purpose == "lift":
                here.arm.halt()
                here.arm.positions[here.arm.names[0]] += 0.5
                while here.robot.state()[0][0] < 2.0:
                    here.robot._link.wait(0.02)
