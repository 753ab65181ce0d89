"""An arm carries out what the twin has built only as planned and approved, and never claims that anything stands."""

from contextlib import ExitStack, nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

from agent.arm.arm_file import load_arm
from agent.arm.build_listeners import BuildListeners
from agent.arm.events import Noticed, PickFailed, Placed
from agent.arm.executor import build_structure
from agent.arm.kinematics import Kinematics
from agent.arm.simulated_arm import SimulatedArm
from agent.errors import EXECUTED, ROBOT_REFUSED, ExecutedUnverified, ExecutionFailed, RobotRefused, RobotStopped
from agent.pipeline.real_arm import RealArm, RobotOptions
from agent.recordings.trajectory_export import Motion, TrajectoryLog
from agent.robots.interfaces import KinovaRos, Ros2Kortex
from agent.robots.limits import JointLimits
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement, Table
from structdiffusion.simulation.world import TabletopWorld
from tests.agent.arm.gen3 import write_arm
from tests.agent.robots.conftest import MODEL, PATIENT, way
from tests.agent.robots.physics_arm import PhysicsArm
from tests.agent.robots.rosbridge_server import StandInArm, running

NAME = "left"


class Log:
    """A log of the twin with one motion there and one back."""

    def motions(self, model):
        there, fingers = way(0.6), np.full((11, 3), 0.2)
        ways = (("reach cup 1", there.positions), ("fold", there.positions[::-1]))
        return [
            Motion(name, 0.6 * k, there.times, joints, fingers, np.concatenate((joints, fingers), axis=1))
            for k, (name, joints) in enumerate(ways)
        ]


class TwinTable(SimpleNamespace):
    """A table on which the twin has moved one cup."""

    def poses(self):
        self.looks += 1
        return {"cup 1": pose_from_xyz_yaw(0.4, 0.1 if self.looks == 1 else -0.2, 0.0, 0.0)}

    def moved_since(self, poses):
        return ("cup 1",)


@pytest.fixture
def table():
    world = TabletopWorld((), np.zeros((0, 4, 4)), Table())
    yield TwinTable(
        arm=SimulatedArm(world.client),
        world=world,
        prefix="j2s7s300_",
        notes=("its table is level",),
        missing={},
        looks=0,
    )
    world.close()


@pytest.fixture
def cell():
    """The arm, its server and its address."""
    limits = JointLimits.of_arm(MODEL, f"{NAME}_")
    arm = StandInArm(limits.names, MODEL.folded, limits.fingers)
    with running(KinovaRos(NAME), arm) as (server, address):
        yield arm, server, address


def carried_out(table, address, answer, asked=None):
    """Return the remarks of a run up to its end, and the error that ends it."""
    remarks = []

    def approved(question):
        if asked is not None:
            asked.append(question)
        return answer

    with RealArm(RobotOptions(address, approved, NAME, PATIENT), table, nullcontext) as arm:
        try:
            for work in (arm.connect(), arm.carry_out(Log())):
                remarks += (each.message for each in work)
        except Exception as error:
            return remarks, error
    raise AssertionError("a run with an arm ends with an error: it is not verified")


def test_an_approved_run_ends_as_executed_and_not_verified(table, cell):
    arm, server, address = cell
    asked = []
    remarks, error = carried_out(table, address, True, asked)
    assert isinstance(error, ExecutedUnverified) and error.exit_code == EXECUTED
    assert "all 2 motions; not verified" in str(error)
    assert remarks[-2:] == ["the arm, 1 of 2: reach cup 1", "the arm, 2 of 2: fold"]
    (question,) = asked
    assert "cup 1 from (0.40, 0.10) to (0.40, -0.20) m" in question and "2 motions in about 1 s" in question
    assert "Assumed: its table is level" in question
    assert arm.goals == 2


def test_without_approval_nothing_moves(table, cell):
    arm, server, address = cell
    _, error = carried_out(table, address, False)
    assert isinstance(error, RobotRefused) and error.exit_code == ROBOT_REFUSED and "nobody approved" in str(error)
    assert not arm.goals and not arm.moved


def test_another_start_is_refused_before_anything_is_planned(table, cell):
    arm, server, address = cell
    arm.positions[arm.names[1]] = 3.0
    remarks, error = carried_out(table, address, True)
    assert isinstance(error, RobotRefused) and "left_joint_2 stands at 3.000 rad, planned: 3.930 rad" in str(error)
    assert not remarks and not arm.goals


def test_an_arm_that_was_moved_while_the_question_stood_is_refused(table, cell):
    arm, server, address = cell

    def moved_meanwhile(question):
        arm.positions[arm.names[1]] = 3.0
        seen = len(server.seen)
        while real._robot.state()[0][1] > 3.5:
            real._robot._link.wait(0.02)
        return len(server.seen) == seen

    with RealArm(RobotOptions(address, moved_meanwhile, NAME, PATIENT), table, nullcontext) as real:
        list(real.connect())
        with pytest.raises(RobotRefused, match="left_joint_2 stands at 3.000 rad"):
            list(real.carry_out(Log()))
    assert not arm.goals


def test_a_stop_on_the_way_ends_the_run(table, cell):
    arm, server, address = cell
    arm.fault = "fails"
    _, error = carried_out(table, address, True)
    assert isinstance(error, RobotStopped) and str(error).startswith("reach cup 1: stopped")
    assert arm.goals == 1 and arm.cancels


@pytest.mark.parametrize(
    ("event", "said"),
    (
        (PickFailed(0, "cup 1", "across", 1, "it slipped"), "cup 1: it slipped"),
        (Noticed(0, "cup 1", "moved", "was moved", "place again"), "cup 1 was moved"),
    ),
)
def test_a_rehearsal_that_went_otherwise_moves_no_arm(table, event, said):
    arm = RealArm(RobotOptions("ws://127.0.0.1:9", lambda question: True), table, nullcontext)
    with pytest.raises(ExecutionFailed, match=f"the arm was not moved: .*{said}"):
        list(arm.rehearsal(iter((event,))))
    assert list(arm.rehearsal(iter(("planned",)))) == ["planned"]


def placed(again="", aside=False):
    return Placed(0, "cup 1", aside, 0.0, 0.0, np.eye(4), 1.0, again=again)


def test_a_rehearsal_that_had_to_correct_a_placement_moves_no_arm(table):
    arm = RealArm(RobotOptions("ws://127.0.0.1:9", lambda question: True), table, nullcontext)
    with pytest.raises(ExecutionFailed, match=r"\(cup 1 stood 3.4 cm from its goal\)"):
        list(arm.rehearsal(iter((placed(), placed("stood 3.4 cm from its goal")))))
    planned = (placed(aside=True), placed("had been set aside"))
    assert list(arm.rehearsal(iter(planned))) == list(planned)


def interface_of(model):
    """Return the driver's interface of a model, and its joints as the driver names them."""
    if model is MODEL:
        return KinovaRos(model.name), JointLimits.of_arm(model, f"{model.name}_")
    limits = JointLimits.of_arm(model)
    return Ros2Kortex(knuckle=limits.fingers[0]), limits


@pytest.mark.parametrize("maker", ("jaco", "gen3"))
def test_an_arm_in_physics_behind_a_server_builds_what_the_twin_has_built(maker, tmp_path):
    """The arm is watched by the clock of the second table's physics."""
    model = MODEL if maker == "jaco" else load_arm(write_arm(tmp_path))
    kinematics, objects = Kinematics(model, model.mounted), [procedural_object("candle", 0)]
    start, goal = pose_from_xyz_yaw(0.42, -0.15, 0.0, 0.6), pose_from_xyz_yaw(0.47, 0.1, 0.0, 0.9)
    interface, limits = interface_of(model)
    with ExitStack() as ends:
        twin, second = (ends.enter_context(TabletopWorld(objects, [start], Table())) for _ in range(2))
        arm = SimulatedArm(twin.client, kinematics)
        table = TwinTable(arm=arm, world=twin, prefix="", notes=(), missing={}, looks=0)
        behind = PhysicsArm(second, SimulatedArm(second.client, kinematics), limits.names, limits.fingers)
        _, address = ends.enter_context(running(interface, behind))
        ends.enter_context(behind.passing())
        options = RobotOptions(address, lambda question: True, None, PATIENT, behind.now)
        real = ends.enter_context(RealArm(options, table, nullcontext))
        log, rng = TrajectoryLog(), np.random.default_rng(0)
        list(real.connect())
        behind.go.clear()  # its time stands still meanwhile
        arrangement = Arrangement((goal @ np.linalg.inv(start))[None])
        scene, listeners = twin.observe(rng), BuildListeners(log=log)
        list(real.rehearsal(build_structure(twin, arm, scene, [arrangement], rng=rng, listeners=listeners)))
        behind.go.set()
        with pytest.raises(ExecutedUnverified, match="carried out all .* motions; not verified"):
            list(real.carry_out(log))
        assert np.linalg.norm((twin.pose(0) - goal)[:3, 3]) < 0.02
        assert np.linalg.norm((second.pose(0) - twin.pose(0))[:3, 3]) < 0.01
        assert second.pose(0)[2, 2] > 0.99 and not behind.cancels


def test_a_hand_whose_fingers_slide_is_refused(table):
    hand = SimpleNamespace(fingers=("left",), zero=np.array([0.04]), rate=np.array([-1.0]), closed=0.04)
    model = SimpleNamespace(name="panda", chain=(), fingers={"left": (0.04, 0.0)})
    table.arm = SimpleNamespace(
        kinematics=SimpleNamespace(model=model), hand=hand, configuration=lambda: np.zeros(7), wound=np.zeros(7)
    )
    with RealArm(RobotOptions("ws://127.0.0.1:9", lambda question: True), table, nullcontext) as arm:
        with pytest.raises(RobotRefused, match="hand of the panda .*: left is no joint that turns from 0 rad"):
            list(arm.connect())
