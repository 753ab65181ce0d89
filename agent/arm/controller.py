"""Move the arm in physics: follow paths, close and open the hand."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Protocol

import numpy as np
import pybullet

from agent.arm.simulated_arm import SimulatedArm
from agent.arm.trajectories import trajectory
from structdiffusion.simulation.world import TIME_STEP, TabletopWorld

TRANSFER_SPEED = 0.9  # of the joints' limits, where nothing is near
CARTESIAN_SPEED = 0.5  # of the joints' limits, near objects
HALTING_SECONDS = 0.2
THIRD_FINGER_SECONDS = 0.3  # that the third finger gets after both sides touch
# Nm: the screw that drives a finger cannot be driven back, so a locked one holds more than its motor's effort
LOCKED = 10.0
SQUEEZING_SECONDS = 0.6
# The share of a finger's torque that its tip gets: one motor drives both, so a tip folds where the rest is stopped.
# What is touched nearer to the joint of the tip than 0.4 / 0.6 of the lower half's 44 mm makes it fold.
TIP_SHARE = 0.4
TIP_LEAD = 0.05  # rad ahead of a tip that its motor aims for, so that it folds at about 1 rad/s
FLAT_SQUEEZE = 0.25  # share of the force on what is flat: cutlery is light, and rolls between fingers that press harder
SLIDING_SPEED = 0.2  # of the joints' limits, with an object that the table carries
GRIP_ITERATIONS = 200  # of the engine's solver, which it takes to bring the motors' torque to the contacts


def both_sides(touching: Collection[int]) -> bool:
    """Return whether the first finger (0) and at least one opposite finger are among `touching`."""
    return 0 in touching and len(touching) >= 2


def between(touching: Mapping[int, set[int]]) -> tuple[int, set[int]]:
    """Return the body that most fingers touch, one on both sides if there is any, and which fingers.

    Args:
        touching: body -> the fingers that touch it.
    """
    return max(touching.items(), key=lambda one: (both_sides(one[1]), len(one[1])))


def press(arm: SimulatedArm, angles: np.ndarray, effort: float, folded: bool = False) -> None:
    """Let the fingers press towards `angles` (F,), and their tips fold.

    Args:
        effort: Nm or N, of those that are not locked.
        folded: whether that is done: a locked finger stays as it is then, and no object that swings in the hand unfolds
            it.
    """
    locked, count = arm.hand.locked, len(arm.tips)
    stays = locked[:count] & folded
    tips = arm.tip_angles() + TIP_LEAD * ~stays
    arm.command_fingers(
        list(angles),
        np.where(locked, LOCKED, effort).tolist(),
        list(tips),
        np.where(stays, LOCKED, TIP_SHARE * effort).tolist(),
    )


class MotionListener(Protocol):
    """Any listener to the commands of the arm."""

    def begin(self, doing: str, arm: SimulatedArm) -> None:
        """Record that a motion begins; `doing` names its purpose."""

    def step(self, arm: SimulatedArm) -> None:
        """Record that a physics step is done."""


class ArmDriver:
    """A driver of the arm in the world's physics, step by step.

    Args:
        world: the true objects.
        arm: the arm, in `world.client`.
        on_step: called after every physics step, or `None`.
        log: receives every motion, or `None`.
    """

    def __init__(
        self,
        world: TabletopWorld,
        arm: SimulatedArm,
        on_step: Callable[[], None] | None = None,
        log: MotionListener | None = None,
    ) -> None:
        self.world, self.arm, self.on_step, self.log = world, arm, on_step, log

    def halt(self) -> None:
        """Stop the joints where they are."""
        self._begin("stop")
        self.arm.command(self.arm.configuration())
        self.wait(HALTING_SECONDS)

    def let_sleep(self, allowed: bool) -> None:
        """Set whether the engine may skip objects at rest until they are touched, which saves most of the time."""
        state = pybullet.ACTIVATION_STATE_ENABLE_SLEEPING if allowed else pybullet.ACTIVATION_STATE_DISABLE_SLEEPING
        for body in self.world.bodies:
            pybullet.changeDynamics(body, -1, activationState=state, physicsClientId=self.world.client)
            if not allowed:
                self._wake(body)

    def _wake(self, body: int) -> None:
        pybullet.changeDynamics(
            body, -1, activationState=pybullet.ACTIVATION_STATE_WAKE_UP, physicsClientId=self.world.client
        )

    def step(self) -> None:
        """Advance physics by one step."""
        self.world.step(TIME_STEP)
        if self.log is not None:
            self.log.step(self.arm)
        if self.on_step is not None:
            self.on_step()

    def _begin(self, doing: str) -> None:
        if self.log is not None:
            self.log.begin(doing, self.arm)

    def wait(self, seconds: float) -> None:
        """Let physics run while the arm holds still."""
        for _ in range(round(seconds / TIME_STEP)):
            self.step()

    def follow(
        self, path: np.ndarray, doing: str, speed: float = TRANSFER_SPEED, stop: Callable[[], bool] | None = None
    ) -> np.ndarray:
        """Drive the joints along a path (T, n), from wherever its continuous joints have wound to.

        Args:
            path: joint angles.
            doing: the purpose, as passed to the listener.
            speed: a fraction of the joints' speed limits.
            stop: asked after every step whether to stop there.

        Returns:
            The joint angles (S, n) that were commanded, step by step.
        """
        self._begin(doing)
        now, model = self.arm.configuration(), self.arm.kinematics.model
        turns = 2 * np.pi * np.round((now - path[0]) / (2 * np.pi))
        path = path + np.where(model.continuous, turns, 0.0)
        steps = trajectory(np.concatenate((now[None], path)), TIME_STEP, model.velocity * speed)
        for count, q in enumerate(steps, start=1):
            self.arm.command(q)
            self.step()
            if stop is not None and stop():
                steps = steps[:count]
                break
        self.wait(0.08)
        return steps

    def close(self, *bodies: int, squeeze: float = 1.0) -> tuple[int, set[int]]:
        """Close the fingers until they touch one of `bodies` on both sides; return that one, and which fingers touch
        it.

        What stands beside the hand may stop a finger too: without one that is between them, what the most touch.

        Each finger waits where it touches, so that the object is not pushed; fingers with one drive go on until both
        sides touch. To hold by friction, a third finger gets a little longer; then the fingers press, those that are
        locked only by staying where they are.

        Args:
            bodies: what they may meet.
            squeeze: share of that effort; with 0 the fingers stay where they touch.
        """
        self._begin("close hand")
        arm, hand = self.arm, self.arm.hand
        if not arm.welds:
            arm.brace()
            self.world.refine(GRIP_ITERATIONS)
        targets = arm.finger_angles()
        touched = {body: set[int]() for body in bodies}
        count = len(targets)
        patience = 1 if arm.welds or count == 2 else round(THIRD_FINGER_SECONDS / TIME_STEP)
        while patience:
            waiting = set[int]() if hand.coupled else set[int]().union(*touched.values())
            free = [k for k in range(count) if k not in waiting and targets[k] < hand.closed]
            if not free:
                break
            targets[free] += hand.speed * TIME_STEP
            arm.command_fingers(list(targets))
            self.step()
            for body in bodies:
                touched[body] |= arm.touching(body)
            for k in set[int]().union(*touched.values()) - waiting:
                targets[k] = arm.finger_angles()[k]
            patience -= any(map(both_sides, touched.values()))
        if arm.welds or not squeeze:
            return between(touched)
        self._squeeze(squeeze * hand.grip_effort)
        return between({body: arm.touching(body) for body in bodies})

    def _squeeze(self, effort: float) -> None:
        """Press with `effort`, Nm or N, of each finger that is not locked; tips that fold do so meanwhile."""
        angles = self.arm.finger_angles() + self.arm.hand.squeeze
        for _ in range(round(SQUEEZING_SECONDS / TIME_STEP)):
            press(self.arm, angles, effort)
            self.step()
        press(self.arm, angles, effort, folded=True)

    def take(self, body: int) -> None:
        """Go on with `body` in the hand."""
        self.world.free(body)
        self._wake(body)
        self.arm.take(body)

    def open(self, opening: float) -> None:
        """Command the fingers to the angle `opening`, without waiting for them."""
        self._begin("open hand")
        self.arm.command_fingers([opening] * len(self.arm.fingers))

    def let_go(self, opening: float) -> None:
        """Open the fingers together to the angle `opening`, and where the object is stuck between them there, as far as
        they open; a weld ends when none of them touches the object any more.
        """
        self._begin("open hand")
        arm, held = self.arm, self.arm.held
        self._open_slowly(opening)
        arm.drop()
        self.wait(0.35)
        if held is not None and both_sides(arm.touching(held)):
            self._open_slowly(arm.hand.open)
            self.wait(0.35)

    def _open_slowly(self, opening: float) -> None:
        arm = self.arm
        targets = arm.finger_angles()
        while (targets > opening).any():
            targets = np.maximum(targets - arm.hand.speed * TIME_STEP, opening)
            arm.command_fingers(list(targets))
            self.step()
            if arm.held is not None and not arm.touching(arm.held):
                arm.drop()
        # Fingers that are no farther closed than that may still press: they have stopped where something stopped them.
        arm.command_fingers([opening] * len(targets))
