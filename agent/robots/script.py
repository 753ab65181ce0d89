"""Turn the motions of the twin into the steps of a real arm, and carry them out one by one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from agent.errors import RobotRefused, RobotStopped
from agent.recordings.trajectory_export import Motion
from agent.robots.robot import Robot
from agent.robots.trajectory import Grip, Trajectory

RESTS = 1e-6  # rad: what moves less does not move
LEAST_LAG = 0.06  # rad by which an object keeps a finger from its angle in the twin, to be looked for on the arm


@dataclass(frozen=True, eq=False)
class Step:
    """One motion of the arm or of its fingers.

    Attributes:
        motion: what is asked for.
        lag: (m,) rad by which the twin's fingers stayed behind their angles, because of what they hold.
    """

    motion: Trajectory | Grip
    lag: np.ndarray

    @property
    def holds(self) -> np.ndarray:
        """Return (m,) bool: the fingers that something keeps from their angles."""
        return self.lag > LEAST_LAG


def steps_of(motions: Sequence[Motion], closed: float, drives: int | None = None) -> tuple[Step, ...]:
    """Return the steps of a build: its motions without those in which the arm rests.

    Args:
        motions: what the twin was commanded, and how it moved.
        closed: rad, of a finger that is closed as far as the real one can.
        drives: how many of the fingers are driven, the first ones; the others move with them. By default all are.
    """
    steps: list[Step] = []
    for motion, later in zip(motions, (*motions[1:], motions[-1]) if motions else (), strict=True):
        fingers, arm = np.minimum(motion.fingers[:, :drives], closed), motion.joints.shape[1]
        if np.ptp(fingers, axis=0).max() > RESTS:
            # The twin's hand is told to open and is not waited for; after the motion that follows its fingers rest.
            lag = fingers[-1] - later.moved[-1, arm:][:drives]
            steps.append(Step(Grip(motion.name, fingers[-1]), lag))
        if np.ptp(motion.joints, axis=0).max() > RESTS:
            steps.append(Step(Trajectory(motion.name, motion.times, motion.joints), np.zeros(fingers.shape[1])))
    return tuple(steps)


def check_steps(robot: Robot, steps: Sequence[Step]) -> None:
    """Check all steps against the limits of the arm, and the first against where it stands.

    Raises:
        RobotRefused: if one of them leaves the limits, or the arm stands elsewhere.
    """
    trajectories = [step.motion for step in steps if isinstance(step.motion, Trajectory)]
    for trajectory in trajectories:
        robot.check(trajectory)
    if trajectories:
        robot.check_rest(trajectories[0].start)


def carry_out(robot: Robot, steps: Sequence[Step]) -> Iterator[Step]:
    """Carry out steps in order; yields each that begins.

    Whether something is in the hand is known from the fingers alone: where the twin's object kept a finger from its
    angle, half of that is looked for after each step until the hand opens.

    Raises:
        RobotRefused: if nothing was moved.
        RobotStopped: if the arm was stopped; no later step has begun.
    """
    held: Step | None = None
    moved = False
    for step in steps:
        yield step
        try:
            if isinstance(step.motion, Grip):
                robot.grip(step.motion)
                held = step if step.holds.any() else None
            else:
                robot.follow(step.motion)
            moved = True
            if held is not None:
                _check_held(robot, held)
        except RobotRefused as error:
            if not moved:
                raise
            told = f"{step.motion.purpose}: {error}"
            raise RobotStopped(f"{told}; {robot.stop()}") from error


def _check_held(robot: Robot, held: Step) -> None:
    assert isinstance(held.motion, Grip)
    behind = held.motion.angles - robot.state()[1]
    if (behind[held.holds] < held.lag[held.holds] / 2).all():
        angles = ", ".join(f"{each:.2f}" for each in robot.state()[1])
        planned = ", ".join(f"{each:.2f}" for each in held.motion.angles - held.lag)
        raise RobotRefused(
            f"nothing seems to be in the hand: the fingers stand at {angles} rad, around an object at {planned} rad"
        )
