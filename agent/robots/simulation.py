"""Move the simulated arm by the same interface as a real one, in the time of its physics."""

from __future__ import annotations

import math

import numpy as np

from agent.arm.controller import (
    GRIP_ITERATIONS,
    SQUEEZING_SECONDS,
    THIRD_FINGER_SECONDS,
    both_sides,
    press,
)
from agent.arm.simulated_arm import SimulatedArm
from agent.robots.limits import JointLimits
from agent.robots.link import CANCELED, SUCCEEDED, JointState, Outcome
from agent.robots.trajectory import Grip, Trajectory
from structdiffusion.simulation.world import TIME_STEP, TabletopWorld

SETTLING_SECONDS = 0.1  # after a trajectory, before it is reported as done
MET = 0.05  # rad from its angle at which a finger counts as stopped by something


class SimulatedLink:
    """A way to the arm in a world's physics.

    Args:
        world: the world, with the objects that the arm meets.
        arm: the arm, loaded into `world.client`.
    """

    def __init__(self, world: TabletopWorld, arm: SimulatedArm) -> None:
        self._world, self._arm, self._names = world, arm, JointLimits.of_arm(arm.kinematics.model)
        self._steps, self._began = 0, 0.0
        self._motion: Trajectory | Grip | None = None
        self._outcome: Outcome | None = None
        self._begin_grip(arm.finger_angles())

    def connect(self) -> None:
        """See `Link`; it is always connected."""

    def state(self) -> JointState:
        """See `Link`."""
        names = (*self._names.names, *self._names.fingers)
        fingers = self._arm.finger_angles()[: len(self._names.fingers)]  # one drive may move several, and is reported
        angles = (*self._arm.configuration(), *fingers)
        return JointState(dict(zip(names, map(float, angles), strict=True)), dict.fromkeys(names, self.now()))

    def send(self, motion: Trajectory | Grip) -> None:
        """See `Link`."""
        self._motion, self._outcome, self._began = motion, None, self.now()
        if isinstance(motion, Grip):
            self._begin_grip(self._arm.finger_angles())
            self._arm.brace()
            self._world.refine(GRIP_ITERATIONS)

    def outcome(self) -> Outcome | None:
        """See `Link`."""
        return self._outcome

    def cancel(self) -> str:
        """See `Link`."""
        if self._motion is not None:
            self._motion, self._outcome = None, Outcome(CANCELED)
            self._arm.command(self._arm.configuration())
        return ""

    def halt(self) -> str:
        """See `Link`; `cancel` always works."""
        return ""

    def trouble(self) -> str:
        """See `Link`."""
        return ""

    def now(self) -> float:
        """See `Link`."""
        return self._steps * TIME_STEP

    def wait(self, seconds: float) -> None:
        """See `Link`."""
        for _ in range(max(1, round(seconds / TIME_STEP))):
            if isinstance(self._motion, Trajectory):
                self._follow(self._motion)
            elif self._motion is not None:
                self._grip(self._motion)
            self._world.step(TIME_STEP)
            self._steps += 1

    def close(self) -> None:
        """See `Link`."""

    def _begin_grip(self, fingers: np.ndarray) -> None:
        self._fingers, self._stopped = fingers, np.full(len(fingers), np.inf)  # where they were; where they wait
        self._touched: dict[int, set[int]] = {}  # body -> the fingers that have touched it
        self._patience = 1 if len(fingers) == 2 else round(THIRD_FINGER_SECONDS / TIME_STEP)
        self._pressing_since = math.nan

    def _follow(self, trajectory: Trajectory) -> None:
        elapsed = self.now() - self._began
        self._arm.command(trajectory.at(np.array([elapsed]))[0])
        if elapsed > trajectory.duration + SETTLING_SECONDS:
            self._motion, self._outcome = None, Outcome(SUCCEEDED)

    def _grip(self, grip: Grip) -> None:
        """Drive the fingers on; each that closes waits where it touches something, and then all press, as in a build.

        They press once both sides touch a body, and the third finger had its time, or all have arrived.
        """
        arm, hand, way = self._arm, self._arm.hand, grip.angles - self._fingers
        if math.isnan(self._pressing_since):
            reach = hand.speed * (self.now() - self._began)
            angles = np.minimum(self._fingers + np.clip(way, -reach, reach), self._stopped)
            arm.command_fingers(list(angles))
            for body in self._world.bodies if (way > 0.0).any() else ():
                self._touched.setdefault(body, set()).update(arm.touching(body))
            if not hand.coupled:
                for k in set[int]().union(*self._touched.values()):
                    if way[k] > 0.0 and np.isinf(self._stopped[k]):
                        self._stopped[k] = arm.finger_angles()[k]
            self._patience -= any(map(both_sides, self._touched.values()))
            if reach > np.abs(way).max() or self._patience <= 0:
                self._pressing_since = self.now()
            return
        met = bool((grip.angles - arm.finger_angles() > MET).any())
        over = self.now() - self._pressing_since > SQUEEZING_SECONDS
        if met:
            press(arm, self._fingers + way, hand.grip_effort, folded=over)
        else:
            arm.command_fingers(list(self._fingers + way))
        if over:
            self._motion, self._outcome = None, Outcome(CANCELED if met else SUCCEEDED)
