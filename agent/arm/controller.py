"""Move the arm in physics: follow paths, close and open the hand, hold objects by a weld."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
import pybullet

from agent.arm.arm_model import FINGER_SPEED
from agent.arm.gripper import ANGLES
from agent.arm.kinematics import JacoArm
from agent.arm.trajectories import trajectory
from structdiffusion.simulation.world import TIME_STEP, TabletopWorld

CARTESIAN_SPEED = 0.5  # of the joints' limits, near objects
WELD_FORCE = 200.0  # N, as strong as a rigid attachment needs to be
HALTING_SECONDS = 0.2
LETTING_GO_SECONDS = 0.5  # within which the fingers must be clear of the object
SQUEEZE = 0.15  # rad beyond contact that the finger motors aim for in a grasp held by friction


class MotionListener(Protocol):
    """Any listener to the commands of the arm."""

    def begin(self, doing: str, arm: JacoArm) -> None:
        """Record that a motion begins; `doing` names its purpose."""

    def step(self, arm: JacoArm) -> None:
        """Record that a physics step is done."""


class ArmDriver:
    """A driver of the arm in the world's physics, step by step.

    Args:
        world: the true objects.
        arm: the arm, in `world.client`.
        weld: whether a grasp is held by a fixed constraint, or by the fingers' friction alone.
        on_step: called after every physics step, or `None`.
        log: receives every motion, or `None`.
    """

    def __init__(
        self,
        world: TabletopWorld,
        arm: JacoArm,
        weld: bool,
        on_step: Callable[[], None] | None = None,
        log: MotionListener | None = None,
    ) -> None:
        self.world, self.arm, self.welds, self.on_step, self.log = world, arm, weld, on_step, log

    @property
    def holds(self) -> int | None:
        """Return the body that is welded to the hand, or `None`."""
        return None if self.arm.weld is None else self.arm.weld[1]

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

    def follow(self, path: np.ndarray, doing: str, speed: float = 0.9) -> None:
        """Drive the joints along a path (T, n), from wherever its continuous joints have wound to.

        Args:
            path: joint angles.
            doing: the purpose, as passed to the listener.
            speed: a fraction of the joints' speed limits.
        """
        self._begin(doing)
        now, model = self.arm.configuration(), self.arm.kinematics.model
        turns = 2 * np.pi * np.round((now - path[0]) / (2 * np.pi))
        path = path + np.where(model.continuous, turns, 0.0)
        for q in trajectory(np.concatenate((now[None], path)), TIME_STEP, model.velocity * speed):
            self.arm.command(q)
            self.step()
        self.wait(0.08)

    def close(self, body: int) -> set[int]:
        """Close each finger until it touches `body`; return which fingers touch."""
        self._begin("close hand")
        arm = self.arm
        targets = arm.finger_angles()
        touched: set[int] = set()
        step = FINGER_SPEED * TIME_STEP
        while True:
            free = [k for k in range(3) if k not in touched and targets[k] < ANGLES[-1]]
            if not free or (0 in touched and len(touched) >= 2):
                break
            for k in free:
                targets[k] += step
            arm.command_fingers(list(targets))
            self.step()
            for k in arm.touching(body) - touched:
                touched.add(k)
                targets[k] = arm.finger_angles()[k]
        if not self.welds:
            arm.command_fingers([float(angle) + SQUEEZE for angle in targets])
            self.wait(0.3)
            return arm.touching(body)
        return touched

    def weld(self, body: int) -> None:
        """Weld `body` to the hand in its present pose."""
        arm, client = self.arm, self.world.client
        self.world.free(body)
        self._wake(body)
        position, quaternion = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
        state = pybullet.getLinkState(arm.body, arm.hand, physicsClientId=client)
        inverse = pybullet.invertTransform(state[0], state[1])
        in_hand = pybullet.multiplyTransforms(*inverse, position, quaternion)
        constraint = pybullet.createConstraint(
            arm.body, arm.hand, body, -1, pybullet.JOINT_FIXED, [0, 0, 0], in_hand[0], [0, 0, 0], in_hand[1],
            physicsClientId=client,
        )
        pybullet.changeConstraint(constraint, maxForce=WELD_FORCE, physicsClientId=client)
        arm.weld = (constraint, body)
        arm.command_fingers(list(arm.finger_angles()))

    def open(self, opening: float) -> None:
        """Command the fingers to the angle `opening`, without waiting for them."""
        self._begin("open hand")
        self.arm.command_fingers([opening] * 3)

    def let_go(self, opening: float) -> None:
        """Open the fingers to the angle `opening`; a weld ends when none of them touches the object any more."""
        self.open(opening)
        if self.arm.weld is not None:
            for _ in range(round(LETTING_GO_SECONDS / TIME_STEP)):
                self.step()
                if not self.arm.touching(self.arm.weld[1]):
                    break
            self.arm.drop()
        self.wait(0.35)
