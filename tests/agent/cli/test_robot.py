"""What a run with an arm is asked for, who approves it, and how it ends if nobody does."""

import io
import json

import pytest

from agent.arm.arm_model import arm_model
from agent.cli.app import command_line
from agent.cli.robot import robot_options
from agent.errors import ROBOT_REFUSED, USAGE, RobotRefused, UsageError
from agent.robots.interfaces import KinovaRos
from agent.robots.limits import JointLimits
from tests.agent.robots.rosbridge_server import StandInArm, running

HERE = "rosbridge://127.0.0.1:9090"


class Terminal(io.StringIO):
    """Standard input that is a terminal."""

    def isatty(self):
        return True


def options(robot=HERE, arm=None, approve=True, execute=True, hold="friction", disturb=None):
    """Return what is made of the options of a run."""
    return robot_options(robot, arm, approve, execute, hold, disturb)


@pytest.mark.parametrize(
    ("robot", "address"),
    (
        (HERE, "ws://127.0.0.1:9090"),
        ("rosbridge://jaco.local", "ws://jaco.local:9090"),
        ("rosbridge://[::1]:8080", "ws://[::1]:8080"),
        ("simulation", "simulation"),
    ),
)
def test_legal_addresses(robot, address):
    assert options(robot).address == address


@pytest.mark.parametrize(
    "robot",
    ("", "jaco", "ws://127.0.0.1", "rosbridge://", "rosbridge://h:99999", "rosbridge://h:1/x", "rosbridge://u@h"),
)
def test_other_addresses_are_refused_with_the_legal_ones(robot):
    with pytest.raises(UsageError, match="legal: rosbridge://HOST:PORT, or simulation"):
        options(robot)


@pytest.mark.parametrize(("arm", "name"), ((None, None), ("jaco", None), ("jaco:left_1", "left_1")))
def test_legal_arms(arm, name):
    assert options(arm=arm).name == name


def test_the_file_of_an_arm_is_legal(tmp_path):
    path = tmp_path / "gen3.yaml"
    path.write_text("urdf: gen3.urdf")
    assert options(arm=str(path)).name is None


@pytest.mark.parametrize("arm", ("", "gen3", "jaco:", "jaco:a b", "jaco:/left"))
def test_other_arms_are_refused(arm):
    if arm == "":
        arm = " "
    with pytest.raises(UsageError, match="--arm cannot be .*; legal: jaco, jaco:NAME .*YAML"):
        options(arm=arm)


@pytest.mark.parametrize(
    ("wrong", "said"),
    (
        ({"execute": False}, "--no-execute"),
        ({"hold": "weld"}, "--hold weld"),
        ({"disturb": "push"}, "--disturb"),
        ({"robot": None}, "--approve needs --robot"),
        ({"robot": None, "approve": False, "arm": "jaco:left"}, "--arm jaco:NAME needs --robot"),
    ),
)
def test_options_that_do_not_go_together(wrong, said):
    with pytest.raises(UsageError, match=said):
        options(**wrong)


@pytest.mark.parametrize("stdin", (io.StringIO("y\n"), None))
def test_without_a_terminal_only_the_option_approves(stdin, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", stdin)
    with pytest.raises(RobotRefused, match="--approve gives the approval in advance"):
        options(approve=False)
    assert options().approved("cup 1 from here to there")
    assert "cup 1 from here to there" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("typed", "agreed"), (("y\n", True), ("YES\n", True), ("\n", False), ("n\n", False), ("yeah\n", False), ("", False))
)
def test_only_a_yes_in_the_terminal_is_an_approval(typed, agreed, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", Terminal(typed))
    assert options(approve=False).approved("cup 1 from here to there") is agreed
    said = capsys.readouterr()
    assert "cup 1 from here to there\nMove the arm now? [y/N]" in said.err and not said.out


def test_a_run_refuses_an_arm_that_stands_elsewhere(tmp_path, capsys):
    model = arm_model("j2s7s300")
    limits = JointLimits.of_arm(model, "left_")
    arm = StandInArm(limits.names, model.folded + 0.2 * (model.folded == 5.04), limits.fingers)
    with running(KinovaRos("left"), arm) as (_, address):
        where = ["--robot", address.replace("ws", "rosbridge"), "--arm", "jaco:left", "--approve", "--json"]
        code = command_line(["run", "put the cups in a circle", "--model", "geometric", "--out", str(tmp_path), *where])
    said = capsys.readouterr()
    assert code == ROBOT_REFUSED
    assert "left_joint_4 stands at 5.240 rad, planned: 5.040 rad" in said.err
    assert json.loads(said.out)["outcome"]["exit_code"] == ROBOT_REFUSED
    assert not arm.goals and not arm.moved


def test_a_run_names_an_illegal_address(capsys):
    assert command_line(["run", "a line", "--robot", "jaco"]) == USAGE
    assert "--robot cannot be 'jaco'" in capsys.readouterr().err
