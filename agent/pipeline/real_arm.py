"""Carry out on an arm what the twin has built: compare, ask, move, and say what is not verified."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Self

from agent import events
from agent.arm.arm_model import ARM_MODELS, arm_model
from agent.arm.events import Noticed, PickFailed, Placed, PlaceFailed
from agent.errors import ExecutedUnverified, ExecutionFailed, RobotRefused
from agent.event_base import Event
from agent.pipeline.event_builders import describe_shortfall
from agent.robots.interfaces import CLOSED_RADIANS, Interface, KinovaRos, Ros2Kortex
from agent.robots.limits import JointLimits, Workspace
from agent.robots.robot import Robot
from agent.robots.rosbridge import RosbridgeLink
from agent.robots.script import Step, carry_out, check_steps, steps_of
from agent.robots.simulation import SimulatedLink
from agent.robots.watch import Tolerances

if TYPE_CHECKING:
    from agent.recordings.trajectory_export import TrajectoryLog
    from agent.scenes.table_scene import TableScene

SIMULATION = "simulation"


@dataclass(frozen=True)
class RobotOptions:
    """The arm that carries out a run.

    Attributes:
        address: "ws://HOST:PORT" of its rosbridge server, or `SIMULATION` for a second table in physics.
        approved: asked with a text of several lines that says what will be moved, before anything moves; returns
            whether a person agrees.
        name: what its driver calls it; `None` for the prefix of the joints in the recording, or the model's name.
        tolerances: what is still taken for as planned.
        clock: tells the time by which the arm is watched, s.
    """

    address: str
    approved: Callable[[str], bool]
    name: str | None = None
    tolerances: Tolerances = Tolerances()
    clock: Callable[[], float] = time.monotonic


class RealArm:
    """The arm of one run. Use it in a `with` block, which disconnects.

    Args:
        options: which arm.
        table: the table of the twin, before anything on it has moved.
        again: opens the same table once more, for `SIMULATION`.
    """

    def __init__(self, options: RobotOptions, table: TableScene, again: Callable[[], TableScene]) -> None:
        self._options, self._table, self._again = options, table, again
        self._ends = ExitStack()
        self._start = table.arm.configuration() + table.arm.wound
        self._seen_at = table.poses()
        self._robot: Robot | None = None
        hand = table.arm.hand
        self._closed = float(CLOSED_RADIANS) if _is_jaco(table) and options.address != SIMULATION else hand.closed

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ends.close()

    def connect(self) -> Iterator[Event]:
        """Connect to the arm, and compare its joints with those that the twin begins with; yields a remark.

        Raises:
            RobotRefused: if the arm cannot be reached, or stands elsewhere.
        """
        kinematics, options = self._table.arm.kinematics, self._options
        _check_hand(self._table)
        if options.address == SIMULATION:
            second = self._ends.enter_context(self._again())
            limits = JointLimits.of_arm(kinematics.model)
            link: SimulatedLink | RosbridgeLink = SimulatedLink(second.world, second.arm)
        else:
            interface, limits = self._driver()
            link = RosbridgeLink(options.address, interface, limits.names, options.clock)
        top = self._table.world.table
        workspace = Workspace.above((top.x_min, top.x_max, top.y_min, top.y_max), kinematics)
        robot = self._ends.enter_context(Robot(link, limits, workspace, options.tolerances))
        robot.connect()
        robot.check_rest(self._start)
        self._robot = robot
        yield events.Noted(
            f"the {kinematics.model.name} at {options.address} is in the same pose as the twin; a rehearsal in "
            "the simulation follows, and the arm does not move before you agree"
        )

    def _driver(self) -> tuple[Interface, JointLimits]:
        """Return the interface of the driver that this arm has, and its joints as the driver names them."""
        model = self._table.arm.kinematics.model
        if not _is_jaco(self._table):
            limits = JointLimits.of_arm(model)
            return Ros2Kortex(knuckle=limits.fingers[0]), limits
        name = self._options.name or self._table.prefix.rstrip("_") or model.name
        return KinovaRos(name), JointLimits.of_arm(model, f"{name}_")

    def rehearsal(self, building: Iterator[Event]) -> Iterator[Event]:
        """Yield the events of the twin's build.

        Raises:
            ExecutionFailed: in the end, if something did not go as planned: then the objects of the twin are not where
                those of the arm would be.
        """
        trouble, aside = "", set[int]()
        for event in building:
            if isinstance(event, PickFailed | PlaceFailed):
                trouble = trouble or f"{event.name}: {event.reason}"
            elif isinstance(event, Noticed):
                trouble = trouble or f"{event.name} {event.detail}"
            elif isinstance(event, Placed):
                # It was placed again where the twin has seen it; that of the arm has slipped elsewhere.
                if event.again and event.object not in aside:
                    trouble = trouble or f"{event.name} {event.again}"
                (aside.add if event.aside else aside.discard)(event.object)
            yield event
        if trouble:
            raise ExecutionFailed(
                f"the arm was not moved: the rehearsal did not go as planned ({trouble}); another --seed makes another "
                "plan"
            )

    def carry_out(self, log: TrajectoryLog) -> Iterator[Event]:
        """Ask, carry out the motions of the log, and end with `ExecutedUnverified`; yields remarks.

        Raises:
            RobotRefused: if nothing was moved.
            RobotStopped: if the arm was stopped on the way.
            ExecutedUnverified: if every motion was carried out: nobody has looked whether anything stands.
        """
        robot = self._robot
        assert robot is not None
        model = self._table.arm.kinematics.model
        steps = steps_of(log.motions(model), self._closed, len(model.fingers))
        check_steps(robot, steps)
        if not steps:
            raise RobotRefused("nothing has to be moved, and the arm was not moved")
        if not self._options.approved(self._question(log, steps)):
            raise RobotRefused("the arm was not moved, because nobody approved it")
        check_steps(robot, steps)  # the question may have taken a while
        robot.approve()
        yield events.Noted("approved: the arm moves")
        work = carry_out(robot, steps)
        try:
            for count, step in enumerate(work, start=1):
                yield events.Noted(f"the arm, {count} of {len(steps)}: {step.motion.purpose}")
        except (KeyboardInterrupt, SystemExit) as interruption:
            notes = getattr(interruption, "__notes__", [])
            yield events.Noted(f"interrupted: {'; '.join(notes) or 'the arm stands still'}")
            raise
        shortfall = describe_shortfall(self._table, "took part")
        raise ExecutedUnverified(
            f"the arm carried out all {len(steps)} motions; not verified: no camera has looked at what stands there"
            + (f"; {shortfall}" if shortfall else "")
        )

    def _question(self, log: TrajectoryLog, steps: tuple[Step, ...]) -> str:
        table, kinematics = self._table, self._table.arm.kinematics
        motions = log.motions(kinematics.model)
        seconds = motions[-1].start + float(motions[-1].times[-1])
        lines = [
            f"The {kinematics.model.name} at {self._options.address} will carry out {len(steps)} motions in about "
            f"{seconds:.0f} s, and move:"
        ]
        poses = table.poses()
        for name in table.moved_since(self._seen_at):
            was, now = self._seen_at[name][:2, 3], poses[name][:2, 3]
            lines.append(f"  {name} from ({was[0]:.2f}, {was[1]:.2f}) to ({now[0]:.2f}, {now[1]:.2f}) m")
        shortfall = describe_shortfall(table, "take part")
        lines += [f"Assumed: {note}" for note in (*table.notes, *((shortfall,) if shortfall else ()))]
        lines += [
            "No camera watches the table meanwhile: the objects must stand where the twin has them.",
            "Keep out of the arm's reach, with a hand on its emergency stop.",
        ]
        return "\n".join(lines)


def _is_jaco(table: TableScene) -> bool:
    model = table.arm.kinematics.model
    return model.name in ARM_MODELS and model is arm_model(model.name)


def _check_hand(table: TableScene) -> None:
    """Check that the angles by which a hand is planned are those of the joint by which its driver moves it.

    Raises:
        RobotRefused: if they are not.
    """
    model, hand = table.arm.kinematics.model, table.arm.hand
    sliding = {joint.name for joint in model.chain if joint.slides}
    for name, zero, rate in zip(hand.fingers, hand.zero, hand.rate, strict=True):
        if name in model.fingers and (name in sliding or (zero, rate) != (0.0, 1.0)):
            raise RobotRefused(
                f"the hand of the {model.name} cannot be moved with --robot: {name} is no joint that turns from 0 rad "
                "(open) upwards"
            )
