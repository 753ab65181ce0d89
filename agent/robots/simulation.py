"""Move the simulated arm by the same interface as a real one, in the time of its physics."""

from __future__ import annotations

import numpy as np

from agent.arm.controller import GRIP_ITERATIONS, LOCKED, SQUEEZING_SECONDS, TIP_LEAD, TIP_SHARE
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
        self._fingers = arm.finger_angles()  # when the present grip began

    def connect(self) -> None:
        """See `Link`; it is always connected."""

    def state(self) -> JointState:
        """See `Link`."""
        names = (*self._names.names, *self._names.fingers)
        angles = (*self._arm.configuration(), *self._arm.finger_angles())
        return JointState(dict(zip(names, map(float, angles), strict=True)), dict.fromkeys(names, self.now()))

    def send(self, motion: Trajectory | Grip) -> None:
        """See `Link`."""
        self._motion, self._outcome, self._began = motion, None, self.now()
        if isinstance(motion, Grip):
            self._fingers = self._arm.finger_set_point.copy()
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

    def _follow(self, trajectory: Trajectory) -> None:
        elapsed = self.now() - self._began
        self._arm.command(trajectory.at(np.array([elapsed]))[0])
        if elapsed > trajectory.duration + SETTLING_SECONDS:
            self._motion, self._outcome = None, Outcome(SUCCEEDED)

    def _grip(self, grip: Grip) -> None:
        """Drive the fingers on; where something stops one, fingers 2 and 3 press on it, as in a build of the twin."""
        arm, hand = self._arm, self._arm.hand
        reach = hand.speed * (self.now() - self._began)
        way = grip.angles - self._fingers
        met = bool((grip.angles - arm.finger_angles() > MET).any())
        if met and reach > np.abs(way).max():
            efforts = np.where(hand.locked, LOCKED, hand.grip_effort).tolist()
            tips = list(arm.tip_angles() + TIP_LEAD)
            arm.command_fingers(list(grip.angles), efforts, tips, [TIP_SHARE * hand.grip_effort] * len(tips))
        else:
            arm.command_fingers(list(self._fingers + np.clip(way, -reach, reach)))
        if reach > np.abs(way).max() + hand.speed * SQUEEZING_SECONDS:
            self._motion, self._outcome = None, Outcome(CANCELED if met else SUCCEEDED)
