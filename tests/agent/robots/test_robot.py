"""A robot behind rosbridge moves only after approval, stops at whatever is not as planned, and claims nothing false."""

from dataclasses import replace

import numpy as np
import pytest

from agent.arm.arm_file import load_arm
from agent.errors import RobotRefused, RobotStopped
from agent.robots.interfaces import Ros2Kortex
from agent.robots.limits import JointLimits
from agent.robots.robot import Robot
from agent.robots.rosbridge import RosbridgeLink
from agent.robots.trajectory import Grip, Trajectory
from tests.agent.arm.gen3 import write_arm
from tests.agent.robots.conftest import MODEL, PATIENT, way
from tests.agent.robots.rosbridge_server import StandInArm, running

LONG = (20.0, 6.0)  # s and rad: a motion that goes on until it is stopped
SHORT = way(0.6)


def goals_of(server):
    return [
        each
        for each in server.seen
        if each["op"] == "send_action_goal" or (each["op"] == "publish" and each["topic"].endswith("/goal"))
    ]


def stays_stopped(cell, said):
    """Nothing moves after a stop, although it is asked for; no goal reaches the server any more."""
    goals = len(goals_of(cell.server))
    with pytest.raises(RobotRefused, match="approved"):
        cell.robot.follow(SHORT)
    with pytest.raises(RobotRefused, match="approved"):
        cell.robot.grip(Grip("close hand", np.full(3, 1.0)))
    assert len(goals_of(cell.server)) == goals
    assert "succeeded" not in said or "but" in said


def test_nothing_moves_without_approval(cell):
    here = cell()
    with pytest.raises(RobotRefused, match="approved"):
        here.robot.follow(SHORT)
    with pytest.raises(RobotRefused, match="approved"):
        here.robot.grip(Grip("close hand", np.full(3, 1.0)))
    assert not goals_of(here.server) and not here.arm.moved


@pytest.mark.parametrize("fault", ("", "other order"))
def test_an_approved_motion_arrives_whatever_the_order_of_the_joints(cell, fault):
    here = cell(fault)
    here.robot.approve()
    here.robot.follow(SHORT)
    joints, _ = here.robot.state()
    assert np.abs(joints - SHORT.goal).max() < 1e-3
    assert not here.arm.cancels and not here.arm.halts


def test_an_arm_from_a_file_moves_and_is_held_to_the_speed_of_its_file(tmp_path):
    model, interface = load_arm(write_arm(tmp_path, speed=0.5)), Ros2Kortex()
    limits = JointLimits.of_arm(model)
    there = model.folded + 0.3 * np.eye(7)[6]
    slow, fast = (
        Trajectory("turn the hand", np.array([0.0, seconds]), np.stack((model.folded, there))) for seconds in (1.0, 0.5)
    )
    with running(interface, StandInArm(limits.names, model.folded, limits.fingers)) as (_, address):
        with Robot(RosbridgeLink(address, interface, limits.names), limits, tolerances=PATIENT) as robot:
            robot.connect()
            robot.approve()
            robot.follow(slow)
            assert np.abs(robot.state()[0] - there).max() < 1e-3
    with pytest.raises(RobotRefused, match="joint_7 would turn at 0.600 rad/s; legal: at most 0.500"):
        limits.check(fast)


def test_fingers_stop_at_what_they_grip_and_open_again(cell):
    here = cell()
    here.robot.approve()
    assert np.allclose(here.robot.grip(Grip("close hand", np.full(3, 1.0))), 0.85, atol=0.01)
    assert np.allclose(here.robot.grip(Grip("open hand", np.full(3, 0.2))), 0.2, atol=0.01)


@pytest.mark.parametrize(
    ("fault", "said"),
    (
        ("refuses", "refused the motion"),
        ("fails", "ended the motion as 'failed'"),
        ("goes elsewhere", "off its path"),
        ("loses the connection", "connection .* was lost"),
    ),
)
def test_a_fault_stops_the_arm_for_good(cell, fault, said):
    here = cell(fault, replace(PATIENT, stopping=1.0))
    here.robot.approve()
    with pytest.raises(RobotStopped, match=said) as stopped:
        here.robot.follow(way(1.0))
    assert here.arm.cancels
    here.arm.fault = ""
    stays_stopped(here, str(stopped.value))


@pytest.mark.parametrize("fault", ("does not move", "early"))
def test_a_false_success_is_noticed(cell, fault):
    here = cell(fault, replace(PATIENT, settle=0.3))
    here.robot.approve()
    with pytest.raises(RobotStopped, match="reports 'succeeded', but") as stopped:
        here.robot.follow(way(*LONG))
    stays_stopped(here, str(stopped.value))


def test_fingers_that_do_not_move_are_noticed(cell):
    here = cell("does not move", replace(PATIENT, settle=0.3))
    here.robot.approve()
    with pytest.raises(RobotStopped, match="close hand: stopped, because .* asked for: 1.000 rad"):
        here.robot.grip(Grip("close hand", np.full(3, 1.0)))


@pytest.mark.parametrize("fault", ("falls silent", "frozen"))
def test_stale_states_stop_the_arm_and_nobody_claims_that_it_stands(cell, fault):
    here = cell(connected=False, tolerances=replace(PATIENT, stale=1.0, stopping=0.3))
    here.robot.connect()
    here.robot.approve()
    here.arm.fault = fault
    with pytest.raises(RobotStopped, match="no joint state came .* NOT KNOWN WHETHER THE ARM STANDS STILL") as stopped:
        here.robot.follow(way(*LONG))
    assert here.arm.cancels
    here.arm.fault = ""
    stays_stopped(here, str(stopped.value))


def test_a_late_result_stops_the_arm(cell):
    here = cell("late", replace(PATIENT, late=0.1, stopping=0.3))
    here.robot.approve()
    with pytest.raises(RobotStopped, match="no result came in") as stopped:
        here.robot.follow(way(0.6))
    here.arm.accept.set()
    stays_stopped(here, str(stopped.value))


class Interrupting(RosbridgeLink):
    """A link during whose waiting somebody presses Ctrl-C, once the arm moves."""

    pressed = False

    def wait(self, seconds):
        super().wait(seconds)
        if not self.pressed and self._actions._id and np.abs(self.state().of(self._names) - MODEL.folded).max() > 0.02:
            self.pressed = True
            raise KeyboardInterrupt


def test_ctrl_c_cancels_and_voids_the_approval(cell):
    here = cell(link=Interrupting)
    here.robot.approve()
    with pytest.raises(KeyboardInterrupt) as interrupted:
        here.robot.follow(way(*LONG))
    assert here.arm.cancels == 1 and interrupted.value.__notes__ == ["the arm stands still"]
    stays_stopped(here, "")


def test_a_cancel_that_is_not_answered_is_said_and_followed_by_a_stronger_stop(cell, ros):
    here = cell("ignores cancel", replace(PATIENT, stopping=0.5), Interrupting)
    here.robot.approve()
    with pytest.raises(KeyboardInterrupt) as interrupted:
        here.robot.follow(way(*LONG))
    (told,) = interrupted.value.__notes__
    assert told.startswith("the driver did not answer the stop")
    assert here.arm.halts == (1 if ros == 1 else 0)  # ros2_kortex has nothing stronger
    assert ("in/stop was called" if ros == 1 else "NOT KNOWN") in told
    stays_stopped(here, "")


def test_a_new_approval_lets_the_arm_move_again(cell):
    here = cell("refuses")
    here.robot.approve()
    with pytest.raises(RobotStopped):
        here.robot.follow(SHORT)
    here.arm.fault = ""
    here.robot.approve()
    here.robot.follow(SHORT)
    assert np.abs(here.robot.state()[0] - SHORT.goal).max() < 1e-3


@pytest.mark.parametrize(
    ("fault", "said"),
    (
        ("degrees", "joint_.* stands at .* rad, planned: .* degrees"),
        ("NaN", "joint_2; legal: a finite angle"),
        ("null", "joint_2; legal: a finite angle"),
        ("joint missing", "does not report .*joint_2; it reports: .*joint_1"),
    ),
)
def test_joint_states_that_cannot_be_used_are_named(cell, fault, said):
    here = cell(fault, connected=False)
    with pytest.raises(RobotRefused, match=said):
        here.robot.connect()
        here.robot.approve()
        here.robot.follow(SHORT)
    assert not goals_of(here.server) and not here.arm.moved


def test_a_wrong_start_is_refused_with_joint_value_and_plan(cell):
    here = cell()
    here.robot.approve()
    name = here.limits.names[3]
    here.arm.positions[name] += 0.2
    with pytest.raises(RobotRefused, match=f"{name} stands at 5.240 rad, planned: 5.040 rad"):
        for _ in range(1000):  # until the change has arrived
            here.robot.check_rest(SHORT.start)
            here.robot._link.wait(0.02)
    with pytest.raises(RobotRefused, match=name):
        here.robot.follow(SHORT)
    assert not goals_of(here.server)


def test_a_joint_that_is_wound_by_a_turn_is_followed_from_there(cell):
    here = cell(connected=False)
    here.arm.positions[here.limits.names[0]] += 2 * np.pi
    here.robot.connect()
    here.robot.approve()
    here.robot.follow(SHORT)
    assert np.isclose(here.robot.state()[0][0], SHORT.goal[0] + 2 * np.pi, atol=1e-3)


def test_a_server_that_is_not_there_is_named(ros, cell):
    here = cell(connected=False)
    link = here.robot._link
    link._connection.address = "ws://127.0.0.1:9"
    with pytest.raises(RobotRefused, match="no rosbridge server answers at ws://127.0.0.1:9"):
        here.robot.connect()
