"""Control the PyBullet body of an arm. n is the number of the arm's joints, F that of its fingers.

In the `end_effector` frame the approach direction is +z and the hand closes along x, the first finger at +x.
"""

from __future__ import annotations

import itertools
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pybullet

from agent.arm.arm_model import END_EFFECTOR
from agent.arm.kinematics import Kinematics
from structdiffusion.geometry import pose_from_position_quaternion, quaternion_from_matrix

HOLDS = ("friction", "weld")
WELD_FORCE = 200.0  # N, as strong as a rigid attachment needs to be
# kg m2 of each link: mostly the drive's, behind its gear. With the maker's masses of the links alone, the engine loses
# half of the motors' torque where a finger presses on something heavier.
FINGER_INERTIA = 3e-4
LINKAGE_FORCE = 200.0  # N or Nm, as strong as a rigid linkage needs to be
LINKAGE_CORRECTION = 0.5  # share of a linkage's error that is taken back in each step of physics


class SimulatedArm:
    """The arm's body in one PyBullet client; it starts folded, with the hand open.

    Args:
        client: a connected physics client.
        kinematics: the kinematics of the arm at its mounting place.

    Attributes:
        kinematics: as given. model, hand: of the arm, and of its hand.
        body: PyBullet body id. joints: the n arm joints. fingers, tips: the joints of each finger, and of its tip.
        end_effector, wrist: link indices. hand_links: the links beyond the arm's last joint.
        finger_links: those of them that the fingers move.
        hold: one of `HOLDS`, how the hand holds objects.
        held: the body that is in the hand, as far as known; `None` while it is empty.
        set_point, finger_set_point: (n,) and (F,), what the motors were commanded last.
        wound: (n,) rad, the whole turns by which a real arm's joints are wound beyond the simulated ones.
    """

    def __init__(self, client: int, kinematics: Kinematics = Kinematics()) -> None:
        self.client, self.kinematics = client, kinematics
        self.model, self.hand = kinematics.model, kinematics.model.hand
        with tempfile.TemporaryDirectory() as folder:  # the engine reads files alone
            path = Path(folder) / "arm.urdf"
            path.write_text(self.model.urdf, encoding="utf-8")
            self.body = pybullet.loadURDF(
                str(path),
                basePosition=kinematics.world_from_base[:3, 3].tolist(),
                baseOrientation=quaternion_from_matrix(kinematics.world_from_base).tolist(),
                useFixedBase=True,
                flags=pybullet.URDF_USE_SELF_COLLISION | pybullet.URDF_USE_SELF_COLLISION_EXCLUDE_PARENT,
                physicsClientId=client,
            )
        infos = [
            pybullet.getJointInfo(self.body, k, physicsClientId=client)
            for k in range(pybullet.getNumJoints(self.body, physicsClientId=client))
        ]
        index = {info[1].decode(): info[0] for info in infos}
        hand = self.hand
        self.joints = [index[name] for name in self.model.joints]
        self.fingers = [index[name] for name in hand.fingers]
        self.tips = [index[name] for name in hand.tips]
        self._followers = [index[each.name] for each in hand.followers]
        self.wrist, self.end_effector = self.joints[-1], index[END_EFFECTOR]
        moves = dict(zip((*self.fingers, *self.tips), (*range(len(self.fingers)), *range(len(self.tips)))))
        moves |= {joint: each.finger for joint, each in zip(self._followers, hand.followers, strict=True)}
        self._finger_of: dict[int, int] = {}  # link -> the number of the finger that it belongs to
        self.hand_links = frozenset([self.wrist])
        for info in infos:  # a parent comes before its children
            link, parent = info[0], info[16]
            if link in moves or parent in self._finger_of:
                self._finger_of[link] = moves.get(link, self._finger_of.get(parent, 0))
            if parent in self.hand_links:
                self.hand_links |= {link}
        self.finger_links = frozenset(self._finger_of)
        self._standing = self._links_up_to(infos, 1 if not kinematics.lowered else 2)
        self.hold = HOLDS[0]
        self.held: int | None = None
        self._weld: int | None = None
        for link in self.finger_links:
            # Rubber-like pads, as on the real fingers; and spinning friction, so that thin things do not turn.
            pybullet.changeDynamics(
                self.body, link, lateralFriction=1.0, spinningFriction=0.01, jointDamping=0.02, physicsClientId=client
            )
        if hand.coupled:
            self._couple()
        self.wound = np.zeros(len(self.joints))
        self.fold_at_once()
        self._allow_overlaps(len(infos))

    def _allow_overlaps(self, count: int) -> None:
        """Let those of `count` links and the base that overlap in the waiting pose overlap always: shapes are rough."""
        for link, other in itertools.combinations(range(-1, count), 2):
            near = pybullet.getClosestPoints(self.body, self.body, 0.0, link, other, physicsClientId=self.client)
            if any(point[8] < 0.0 for point in near):
                pybullet.setCollisionFilterPair(self.body, self.body, link, other, 0, physicsClientId=self.client)

    def _links_up_to(self, infos: Sequence[tuple], count: int) -> list[int]:
        """Return the base, the links that the first `count` joints of the arm move, and all that is fixed to them."""
        found = [-1]
        for info in infos:
            fixed = info[2] == pybullet.JOINT_FIXED
            if info[0] in self.joints[:count] or (fixed and info[16] in found):
                found.append(info[0])
        return found

    def _couple(self) -> None:
        """Join the fingers and what moves with them to the first finger, as their linkage does.

        The links of the hand do not meet each other then, and what their shapes overlap is not looked at.
        """
        hand, first = self.hand, self.fingers[0]
        joined = [(joint, hand.zero[k], hand.rate[k]) for k, joint in enumerate(self.fingers) if k]
        joined += [(joint, each.zero, each.rate) for joint, each in zip(self._followers, hand.followers, strict=True)]
        for joint, zero, rate in joined:
            ratio = rate / hand.rate[0]
            gear = pybullet.createConstraint(
                self.body, joint, self.body, first, pybullet.JOINT_GEAR, [0, 0, 1], [0, 0, 0], [0, 0, 0],
                physicsClientId=self.client,
            )  # fmt: skip
            pybullet.changeConstraint(
                gear, gearRatio=-ratio, relativePositionTarget=zero - ratio * hand.zero[0], erp=LINKAGE_CORRECTION,
                maxForce=LINKAGE_FORCE, physicsClientId=self.client,
            )  # fmt: skip
        for joint in self._followers:  # their own motors are off
            pybullet.setJointMotorControl2(
                self.body, joint, pybullet.VELOCITY_CONTROL, force=0.0, physicsClientId=self.client
            )
        for link, other in itertools.combinations(self.hand_links, 2):
            pybullet.setCollisionFilterPair(self.body, self.body, link, other, 0, physicsClientId=self.client)

    def stand_on(self, table: int) -> None:
        """Declare that the arm's lowest links stand on the body `table`: contact between them does not count as a
        collision.

        For a lower arm these links include the upper arm, because the exact place of the table's edge is unknown.
        """
        for link in self._standing:
            pybullet.setCollisionFilterPair(table, self.body, -1, link, 0, physicsClientId=self.client)

    def fold_at_once(self) -> None:
        """Put the arm into its waiting pose, at rest, the hand open."""
        self.teleport(self.kinematics.folded, [self.hand.open] * len(self.fingers))

    def teleport(self, q: np.ndarray, fingers: Sequence[float] | None = None) -> None:
        """Set the joints (n,), and the fingers (F,), at once and at rest; motors hold them there."""
        joints, values = list(self.joints), [[v] for v in q]
        if fingers is not None:
            joints += self.fingers + self._followers + self.tips
            positions = self.hand.joint_positions(fingers)
            values += [[position] for position in positions.values()] + [[0.0]] * len(self.tips)
        pybullet.resetJointStatesMultiDof(self.body, joints, values, [[0.0]] * len(joints), physicsClientId=self.client)
        self.command(q)
        if fingers is not None:
            self.command_fingers(fingers)

    def set_fingers(self, angles: Sequence[float]) -> None:
        """Set the fingers (F,) at once, without their motors."""
        joints, positions = self.fingers + self._followers, self.hand.joint_positions(angles)
        pybullet.resetJointStatesMultiDof(
            self.body, joints, [[each] for each in positions.values()], [[0.0]] * len(joints),
            physicsClientId=self.client,
        )  # fmt: skip

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
        state = pybullet.getLinkState(self.body, self.wrist, physicsClientId=self.client)
        in_hand = pybullet.multiplyTransforms(*pybullet.invertTransform(state[0], state[1]), position, quaternion)
        self._weld = pybullet.createConstraint(
            self.body, self.wrist, body, -1, pybullet.JOINT_FIXED, [0, 0, 0], in_hand[0], [0, 0, 0], in_hand[1],
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
        efforts: Sequence[float] | None = None,
        tips: Sequence[float] | None = None,
        tip_efforts: Sequence[float] | None = None,
    ) -> None:
        """Let the motors drive the fingers towards `angles` (F,), and their tips, where they fold, towards `tips`, by
        default stretched, with these efforts, Nm or N, by default the hand's.
        """
        hand, count = self.hand, len(self.tips)
        self.finger_set_point = np.array(angles, dtype=np.float64)
        efforts = [hand.effort] * len(self.fingers) if efforts is None else efforts
        tips = [0.0] * count if tips is None else tips
        tip_efforts = [hand.effort] * count if tip_efforts is None else tip_efforts
        pybullet.setJointMotorControlArray(
            self.body,
            self.fingers + self.tips,
            pybullet.POSITION_CONTROL,
            targetPositions=[*(hand.zero + hand.rate * self.finger_set_point).tolist(), *tips],
            forces=[*efforts, *tip_efforts],
            positionGains=[0.1] * (len(self.fingers) + count),
            velocityGains=[1.0] * (len(self.fingers) + count),
            physicsClientId=self.client,
        )

    def configuration(self) -> np.ndarray:
        """Return the arm's joint angles (n,) now."""
        return self._angles(self.joints)

    def finger_angles(self) -> np.ndarray:
        """Return the angles (F,) of the fingers now, which grow as the hand closes."""
        return (self._angles(self.fingers) - self.hand.zero) / self.hand.rate

    def tip_angles(self) -> np.ndarray:
        """Return the angles now by which the tips are folded against their fingers; none where they do not fold."""
        return self._angles(self.tips)

    def _angles(self, joints: list[int]) -> np.ndarray:
        if not joints:
            return np.empty(0)
        states = pybullet.getJointStates(self.body, joints, physicsClientId=self.client)
        return np.array([state[0] for state in states])

    def world_from_ee(self) -> np.ndarray:
        """Return the hand's present pose (4, 4) in the simulation."""
        state = pybullet.getLinkState(
            self.body, self.end_effector, computeForwardKinematics=True, physicsClientId=self.client
        )
        return pose_from_position_quaternion(np.array(state[4]), np.array(state[5]))

    def touching(self, *bodies: int) -> set[int]:
        """Return the fingers, from 0 on, that press on any of the bodies now."""
        contacts = [
            contact
            for body in bodies
            for contact in pybullet.getContactPoints(self.body, body, physicsClientId=self.client)
        ]
        links = {contact[3] for contact in contacts if contact[9] > 0.0}
        return {self._finger_of[link] for link in links if link in self._finger_of}
