"""Compute forward and inverse kinematics of a mounted Jaco, and control its PyBullet body.

By default the arm's base stands at the world origin and is turned by 90 degrees about z, so that its usual
workspace (the base's -y side) lies at world +x. In the `end_effector` frame the approach direction is +z and the hand
closes along x: the thumb (finger 1) at +x, fingers 2 and 3 at -x. n is the number of the arm's joints.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib import resources

import numpy as np
import pybullet

from agent.arm.arm_model import (
    DEFAULT_MODEL,
    END_EFFECTOR,
    FINGER_EFFORT,
    FINGER_INERTIA,
    FINGER_OPEN,
    FINGER_TIPS,
    FINGERS,
    WORLD_FROM_BASE,
    ArmModel,
    arm_model,
)
from structdiffusion.geometry import pose_from_position_quaternion, quaternion_from_matrix

LOWERED = 0.01  # m below the table
HOLDS = ("friction", "weld")
WELD_FORCE = 200.0  # N, as strong as a rigid attachment needs to be


@dataclass(frozen=True, eq=False)
class Kinematics:
    """The kinematics of an arm at its mounting place.

    Attributes:
        model: the model of the arm.
        world_from_base: (4, 4) where its `link_base` stands, upright.
    """

    model: ArmModel = field(default_factory=partial(arm_model, DEFAULT_MODEL))
    world_from_base: np.ndarray = field(default_factory=WORLD_FROM_BASE.copy)

    @property
    def folded(self) -> np.ndarray:
        """Return the waiting pose (n,)."""
        return self.model.folded

    @property
    def lowered(self) -> bool:
        """Return whether the base is lower than the table, and so stands beside it."""
        return bool(self.world_from_base[2, 3] < -LOWERED)

    def forward(self, q: np.ndarray) -> np.ndarray:
        """Return world_from_ee (..., 4, 4) of joint angles (..., n)."""
        q = np.asarray(q, dtype=np.float64)
        return self._frames(q.reshape(-1, q.shape[-1]))[1].reshape(*q.shape[:-1], 4, 4)

    def _frames(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return joint frames (B, n, 4, 4), whose z is the joint axis, and world_from_ee (B, 4, 4)."""
        fixed = self.model.joint_origins
        turned = np.repeat(fixed[None], len(q), axis=0)
        c, s = np.cos(q)[..., None], np.sin(q)[..., None]
        turned[..., 0] = fixed[..., 0] * c + fixed[..., 1] * s
        turned[..., 1] = fixed[..., 1] * c - fixed[..., 0] * s
        frames = np.empty((*q.shape, 4, 4))
        pose = self.world_from_base
        for k in range(q.shape[1]):
            frames[:, k] = pose = pose @ turned[:, k]
        return frames, pose @ self.model.origins[END_EFFECTOR]

    def errors(self, q: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return distances (B,) in metres and angles (B,) in radians between the hand at q (B, n) and targets (B,
        4, 4).
        """
        poses = self.forward(q)
        turn = _rotation_vector(targets[:, :3, :3] @ poses[:, :3, :3].transpose(0, 2, 1))
        return np.linalg.norm(targets[:, :3, 3] - poses[:, :3, 3], axis=1), np.linalg.norm(turn, axis=1)

    def inverse(self, targets: np.ndarray, seeds: np.ndarray, iterations: int = 60) -> tuple[np.ndarray, np.ndarray]:
        """Find joint angles that bring the hand to each target: damped least squares on the Jacobian.

        Args:
            targets: (B, 4, 4) world_from_ee.
            seeds: (B, n) where each search starts; the result is near it where possible.

        Returns:
            (B, n) angles within the model's limits, and (B,) bool: whether the hand is within 2 mm and
            1 degree of the target.
        """
        q = np.array(seeds, dtype=np.float64)
        solved = np.zeros(len(q), dtype=bool)
        active = np.arange(len(q))
        for _ in range(iterations):
            frames, poses = self._frames(q[active])
            target = targets[active]
            step = target[:, :3, 3] - poses[:, :3, 3]
            turn = _rotation_vector(target[:, :3, :3] @ poses[:, :3, :3].transpose(0, 2, 1))
            done = (np.linalg.norm(step, axis=1) < 5e-4) & (np.linalg.norm(turn, axis=1) < 2e-3)
            solved[active[done]] = True
            if done.all():
                break
            keep = ~done
            active, frames, poses = active[keep], frames[keep], poses[keep]
            error = np.concatenate((step[keep], turn[keep]), axis=1)
            axes = frames[..., :3, 2]
            arms = poses[:, None, :3, 3] - frames[..., :3, 3]
            jacobian = np.empty((len(active), 6, q.shape[1]))
            for k, (one, other) in enumerate(((1, 2), (2, 0), (0, 1))):  # by hand: `np.cross` takes five times as long
                jacobian[:, k] = axes[..., one] * arms[..., other] - axes[..., other] * arms[..., one]
                jacobian[:, 3 + k] = axes[..., k]
            damping = 1e-4 + 0.01 * np.minimum(1.0, np.linalg.norm(error, axis=1))
            square = jacobian @ jacobian.transpose(0, 2, 1) + damping[:, None, None] * np.eye(6)
            change = (jacobian.transpose(0, 2, 1) @ np.linalg.solve(square, error[..., None]))[..., 0]
            change *= np.minimum(1.0, 0.5 / np.maximum(np.abs(change).max(axis=1), 1e-9))[:, None]
            q[active] = np.clip(q[active] + change, self.model.lower, self.model.upper)
        return q, solved

    def solve(
        self, target: np.ndarray, rng: np.random.Generator, near: np.ndarray | None = None, restarts: int = 24
    ) -> np.ndarray | None:
        """Find one configuration (n,) for world_from_ee `target`, the nearest to `near` (by default the waiting pose);
        `None` if out of reach.

        By default near the waiting pose.
        """
        near = self.folded if near is None else near
        seeds = self.random(rng, restarts)
        seeds[0] = near
        q, solved = self.inverse(np.broadcast_to(target, (restarts, 4, 4)), seeds)
        if not solved.any():
            return None
        found = self.unwind(q[solved], near)
        return found[np.abs(found - near).max(axis=1).argmin()]

    def random(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Draw (count, n) uniform angles, one turn wide for the continuous joints."""
        model = self.model
        lower = np.where(model.continuous, 0.0, model.lower)
        return rng.uniform(lower, np.where(model.continuous, 2 * math.pi, model.upper), (count, len(model.joints)))

    def unwind(self, q: np.ndarray, near: np.ndarray) -> np.ndarray:
        """Return the same configurations (..., n) with continuous joints turned by whole turns as close as possible
        to `near`.
        """
        lower, upper = self.model.lower, self.model.upper
        turned = q - 2 * math.pi * np.round((q - near) / (2 * math.pi))
        turned = np.where(turned < lower, turned + 2 * math.pi, np.where(turned > upper, turned - 2 * math.pi, turned))
        return np.where(self.model.continuous, turned, q)


def _rotation_vector(rotation: np.ndarray) -> np.ndarray:
    """Return the axis times angle (B, 3) of rotations (B, 3, 3)."""
    skew = 0.5 * np.stack(
        (
            rotation[:, 2, 1] - rotation[:, 1, 2],
            rotation[:, 0, 2] - rotation[:, 2, 0],
            rotation[:, 1, 0] - rotation[:, 0, 1],
        ),
        axis=1,
    )
    sine = np.linalg.norm(skew, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(rotation, axis1=1, axis2=2) - 1.0))
    return skew * (angle / np.maximum(sine, 1e-9))[:, None]


class JacoArm:
    """The arm's body in one PyBullet client; it starts folded, with the hand open.

    Args:
        client: a connected physics client.
        kinematics: the kinematics of the arm at its mounting place.

    Attributes:
        kinematics: as given.
        body: PyBullet body id. joints: the n arm joints. fingers, tips: 3 joints each.
        end_effector, hand: link indices. finger_links: links that may touch an object.
        hold: one of `HOLDS`, how the hand holds objects.
        held: the body that is in the hand, as far as known; `None` while it is empty.
        set_point, finger_set_point: (n,) and (3,) rad, what the motors were commanded last.
        wound: (n,) rad, the whole turns by which a real arm's joints are wound beyond the simulated ones.
    """

    def __init__(self, client: int, kinematics: Kinematics = Kinematics()) -> None:
        self.client, self.kinematics = client, kinematics
        with resources.as_file(kinematics.model.urdf) as path:
            self.body = pybullet.loadURDF(
                str(path),
                basePosition=kinematics.world_from_base[:3, 3].tolist(),
                baseOrientation=quaternion_from_matrix(kinematics.world_from_base).tolist(),
                useFixedBase=True,
                flags=pybullet.URDF_USE_SELF_COLLISION | pybullet.URDF_USE_SELF_COLLISION_EXCLUDE_PARENT,
                physicsClientId=client,
            )
        index = {
            pybullet.getJointInfo(self.body, k, physicsClientId=client)[1].decode(): k
            for k in range(pybullet.getNumJoints(self.body, physicsClientId=client))
        }
        self.joints = [index[name] for name in kinematics.model.joints]
        self.fingers = [index[name] for name in FINGERS]
        self.tips = [index[name] for name in FINGER_TIPS]
        self.hand, self.end_effector = self.joints[-1], index[END_EFFECTOR]
        self.finger_links = frozenset(self.fingers + self.tips)
        self.hold = HOLDS[0]
        self.held: int | None = None
        self._weld: int | None = None
        for link in self.finger_links:
            # Rubber-like pads, as on the real fingers; and spinning friction, so that thin things do not turn.
            pybullet.changeDynamics(
                self.body, link, lateralFriction=1.0, spinningFriction=0.01, jointDamping=0.02, physicsClientId=client
            )
        self.wound = np.zeros(len(self.joints))
        self.fold_at_once()

    def stand_on(self, table: int) -> None:
        """Declare that the arm's lowest links stand on the body `table`: contact between them does not count as a
        collision.

        For a lower arm these links include the upper arm, because the exact place of the table's edge is unknown.
        """
        for link in (-1, *self.joints[: 2 if self.kinematics.lowered else 1]):
            pybullet.setCollisionFilterPair(table, self.body, -1, link, 0, physicsClientId=self.client)

    def fold_at_once(self) -> None:
        """Put the arm into its waiting pose, at rest, the hand open."""
        self.teleport(self.kinematics.folded, [FINGER_OPEN] * 3)

    def teleport(self, q: np.ndarray, fingers: Sequence[float] | None = None) -> None:
        """Set the joints (n,), and the fingers (3,), at once and at rest; motors hold them there."""
        joints, values = list(self.joints), [[v] for v in q]
        if fingers is not None:
            joints += self.fingers + self.tips
            values += [[angle] for angle in fingers] + [[0.0]] * 3
        pybullet.resetJointStatesMultiDof(self.body, joints, values, [[0.0]] * len(joints), physicsClientId=self.client)
        self.command(q)
        if fingers is not None:
            self.command_fingers(fingers)

    def hold_by(self, hold: str) -> None:
        """Hold objects from now on by "friction" alone, or by a "weld" to the hand after contact on both sides.

        Raises:
            ValueError: for another value.
        """
        if hold not in HOLDS:
            raise ValueError(f"hold cannot be {hold!r}; legal values: {', '.join(HOLDS)}")
        self.hold = hold

    def brace(self) -> None:
        """Give the fingers the inertia of their drives, with which they press as hard as their motors can."""
        inertia = [FINGER_INERTIA] * 3
        for link in self.finger_links:
            pybullet.changeDynamics(self.body, link, localInertiaDiagonal=inertia, physicsClientId=self.client)

    @property
    def welds(self) -> bool:
        """Return whether what is in the hand is welded to it."""
        return self.hold == "weld"

    def take(self, body: int) -> None:
        """Declare that `body` is in the hand; by a weld, it is joined to it in its present pose."""
        self.held = body
        if not self.welds:
            return
        position, quaternion = pybullet.getBasePositionAndOrientation(body, physicsClientId=self.client)
        state = pybullet.getLinkState(self.body, self.hand, physicsClientId=self.client)
        in_hand = pybullet.multiplyTransforms(*pybullet.invertTransform(state[0], state[1]), position, quaternion)
        self._weld = pybullet.createConstraint(
            self.body, self.hand, body, -1, pybullet.JOINT_FIXED, [0, 0, 0], in_hand[0], [0, 0, 0], in_hand[1],
            physicsClientId=self.client,
        )  # fmt: skip
        pybullet.changeConstraint(self._weld, maxForce=WELD_FORCE, physicsClientId=self.client)
        self.command_fingers(list(self.finger_angles()))

    def drop(self) -> None:
        """Declare the hand empty, and end the weld if there is one."""
        self.held = None
        if self._weld is not None:
            pybullet.removeConstraint(self._weld, physicsClientId=self.client)
            self._weld = None

    def command(self, q: np.ndarray) -> None:
        """Let the position motors drive the arm joints towards q (n,)."""
        self.set_point = np.array(q, dtype=np.float64)
        pybullet.setJointMotorControlArray(
            self.body,
            self.joints,
            pybullet.POSITION_CONTROL,
            targetPositions=list(q),
            targetVelocities=[0.0] * len(self.joints),
            forces=list(self.kinematics.model.effort),
            positionGains=[0.3] * len(self.joints),
            velocityGains=[1.0] * len(self.joints),
            physicsClientId=self.client,
        )

    def command_fingers(
        self,
        angles: Sequence[float],
        efforts: Sequence[float] = (FINGER_EFFORT,) * 3,
        tips: Sequence[float] = (0.0,) * 3,
        tip_efforts: Sequence[float] = (FINGER_EFFORT,) * 3,
    ) -> None:
        """Let the motors drive the three fingers towards `angles`, and their tips towards `tips`, with these efforts,
        Nm.
        """
        self.finger_set_point = np.array(angles, dtype=np.float64)
        pybullet.setJointMotorControlArray(
            self.body,
            self.fingers + self.tips,
            pybullet.POSITION_CONTROL,
            targetPositions=[*angles, *tips],
            forces=[*efforts, *tip_efforts],
            positionGains=[0.1] * 6,
            velocityGains=[1.0] * 6,
            physicsClientId=self.client,
        )

    def configuration(self) -> np.ndarray:
        """Return the arm's joint angles (n,) now."""
        return self._angles(self.joints)

    def finger_angles(self) -> np.ndarray:
        """Return the finger joint angles (3,) now: thumb, finger 2, finger 3."""
        return self._angles(self.fingers)

    def tip_angles(self) -> np.ndarray:
        """Return the angles (3,) now by which the tips are folded against their fingers."""
        return self._angles(self.tips)

    def _angles(self, joints: list[int]) -> np.ndarray:
        states = pybullet.getJointStates(self.body, joints, physicsClientId=self.client)
        return np.array([state[0] for state in states])

    def world_from_ee(self) -> np.ndarray:
        """Return the hand's present pose (4, 4) in the simulation."""
        state = pybullet.getLinkState(
            self.body, self.end_effector, computeForwardKinematics=True, physicsClientId=self.client
        )
        return pose_from_position_quaternion(np.array(state[4]), np.array(state[5]))

    def touching(self, *bodies: int) -> set[int]:
        """Return the fingers (0 thumb, 1, 2) that press on any of the bodies now."""
        contacts = [
            contact
            for body in bodies
            for contact in pybullet.getContactPoints(self.body, body, physicsClientId=self.client)
        ]
        links = {contact[3] for contact in contacts if contact[9] > 0.0}
        return {k for k in range(3) if self.fingers[k] in links or self.tips[k] in links}
