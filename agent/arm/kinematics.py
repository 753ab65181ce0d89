"""The Kinova Jaco j2s7s300: joints, forward and inverse kinematics, hand opening, and its PyBullet body.

The arm's base stands at the world origin and is turned by 90 degrees about z, so that its usual
workspace (the base's -y side) lies at world +x. In the `end_effector` frame the approach direction
is +z and the hand closes along x: the thumb (finger 1) at +x, fingers 2 and 3 at -x.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from functools import cache
from importlib import resources

import numpy as np
import pybullet

from structdiffusion.geometry import pose_from_position_quaternion, pose_from_xyz_yaw, quaternion_from_matrix

JOINTS = 7
WORLD_FROM_BASE = pose_from_xyz_yaw(0.0, 0.0, 0.0, math.pi / 2)
# Two turns each way for the continuous joints, so that a path may wind but not without end.
LOWER = np.array([-2 * math.pi, 0.8203, -2 * math.pi, 0.5236, -2 * math.pi, 1.1345, -2 * math.pi])
UPPER = np.array([4 * math.pi, 5.4629, 4 * math.pi, 5.7596, 4 * math.pi, 5.1487, 4 * math.pi])
CONTINUOUS = np.array([True, False, True, False, True, False, True])
VELOCITY = np.array([0.628, 0.628, 0.628, 0.628, 0.838, 0.838, 0.838])  # rad/s, the maker's limits
EFFORT = np.array([40.0, 80.0, 40.0, 40.0, 20.0, 20.0, 20.0])  # Nm
FINGER_EFFORT = 2.0  # Nm
FINGER_SPEED = 1.0  # rad/s
# Upper arm leaning back, forearm folded down behind it: the table stays in the camera's view.
FOLDED = np.array([1.571, 3.93, 0.0, 5.04, 3.142, 5.06, 1.571])
FINGER_OPEN = 0.2  # rad


@cache
def joint_origins() -> dict[str, np.ndarray]:
    """Each joint's fixed transform (4, 4) from its parent link, by joint name, as the URDF has it."""
    root = ElementTree.fromstring(resources.files("agent.arm").joinpath("j2s7s300.urdf").read_text())
    origins = {}
    for joint in root.iter("joint"):
        origin = joint.find("origin")
        rpy = [float(v) for v in origin.get("rpy").split()]
        xyz = [float(v) for v in origin.get("xyz").split()]
        origins[joint.get("name")] = pose_from_position_quaternion(
            np.array(xyz), np.array(pybullet.getQuaternionFromEuler(rpy))
        )
    return origins


def _frames(q: np.ndarray, world_from_base: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Joint frames (B, 7, 4, 4), whose z is the joint axis, and world_from_ee (B, 4, 4)."""
    origins = joint_origins()
    pose = np.broadcast_to(world_from_base, (len(q), 4, 4))
    frames = np.empty((len(q), JOINTS, 4, 4))
    for k in range(JOINTS):
        pose = pose @ origins[f"joint_{k + 1}"]
        c, s = np.cos(q[:, k])[:, None], np.sin(q[:, k])[:, None]
        turned = pose.copy()
        turned[:, :, 0] = pose[:, :, 0] * c + pose[:, :, 1] * s
        turned[:, :, 1] = pose[:, :, 1] * c - pose[:, :, 0] * s
        frames[:, k] = pose = turned
    return frames, pose @ origins["joint_end_effector"]


def forward_kinematics(q: np.ndarray, world_from_base: np.ndarray = WORLD_FROM_BASE) -> np.ndarray:
    """world_from_ee (..., 4, 4) of joint angles (..., 7)."""
    q = np.asarray(q, dtype=np.float64)
    return _frames(q.reshape(-1, JOINTS), world_from_base)[1].reshape(*q.shape[:-1], 4, 4)


def _rotation_vector(rotation: np.ndarray) -> np.ndarray:
    """The axis times angle (B, 3) of rotations (B, 3, 3)."""
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


def pose_errors(q: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances (B,) in metres and angles (B,) in radians between the hand at q (B, 7) and targets (B, 4, 4)."""
    poses = forward_kinematics(q)
    turn = _rotation_vector(targets[:, :3, :3] @ poses[:, :3, :3].transpose(0, 2, 1))
    return np.linalg.norm(targets[:, :3, 3] - poses[:, :3, 3], axis=1), np.linalg.norm(turn, axis=1)


def inverse_kinematics(
    targets: np.ndarray,
    seeds: np.ndarray,
    iterations: int = 60,
    world_from_base: np.ndarray = WORLD_FROM_BASE,
) -> tuple[np.ndarray, np.ndarray]:
    """Joint angles that bring the hand to each target: damped least squares on the Jacobian.

    Args:
        targets: (B, 4, 4) world_from_ee.
        seeds: (B, 7) where each search starts; the result is near it where possible.

    Returns:
        (B, 7) angles within `LOWER` and `UPPER`, and (B,) bool: whether the hand is within 2 mm and
        1 degree of the target.
    """
    q = np.array(seeds, dtype=np.float64)
    solved = np.zeros(len(q), dtype=bool)
    active = np.arange(len(q))
    for _ in range(iterations):
        frames, poses = _frames(q[active], world_from_base)
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
        jacobian = np.concatenate((np.cross(axes, arms), axes), axis=2).transpose(0, 2, 1)
        damping = 1e-4 + 0.01 * np.minimum(1.0, np.linalg.norm(error, axis=1))
        square = jacobian @ jacobian.transpose(0, 2, 1) + damping[:, None, None] * np.eye(6)
        change = (jacobian.transpose(0, 2, 1) @ np.linalg.solve(square, error[..., None]))[..., 0]
        change *= np.minimum(1.0, 0.5 / np.maximum(np.abs(change).max(axis=1), 1e-9))[:, None]
        q[active] = np.clip(q[active] + change, LOWER, UPPER)
    return q, solved


def solve(
    target: np.ndarray, rng: np.random.Generator, near: np.ndarray = FOLDED, restarts: int = 24
) -> np.ndarray | None:
    """One configuration (7,) for world_from_ee `target`, the nearest found to `near`; `None` if out of reach."""
    seeds = random_configurations(rng, restarts)
    seeds[0] = near
    q, solved = inverse_kinematics(np.broadcast_to(target, (restarts, 4, 4)), seeds)
    if not solved.any():
        return None
    found = unwind(q[solved], near)
    return found[np.abs(found - near).max(axis=1).argmin()]


def random_configurations(rng: np.random.Generator, count: int) -> np.ndarray:
    """(count, 7) uniform angles, one turn wide for the continuous joints."""
    lower = np.where(CONTINUOUS, 0.0, LOWER)
    return rng.uniform(lower, np.where(CONTINUOUS, 2 * math.pi, UPPER), (count, JOINTS))


def unwind(q: np.ndarray, near: np.ndarray) -> np.ndarray:
    """The same configurations (..., 7), continuous joints brought by whole turns as near to `near` as they go."""
    turned = q - 2 * math.pi * np.round((q - near) / (2 * math.pi))
    turned = np.where(turned < LOWER, turned + 2 * math.pi, np.where(turned > UPPER, turned - 2 * math.pi, turned))
    return np.where(CONTINUOUS, turned, q)


class JacoArm:
    """The arm's body in one PyBullet client, folded, hand open.

    Args:
        client: a connected physics client.
        world_from_base: (4, 4) where the base stands.

    Attributes:
        body: PyBullet body id. joints: the 7 arm joints. fingers, tips: 3 joints each.
        end_effector, hand: link indices. finger_links: links that may touch an object.
        weld: the constraint that holds an object in the hand, and its body; `None` while it is empty.
    """

    def __init__(self, client: int, world_from_base: np.ndarray = WORLD_FROM_BASE) -> None:
        self.client = client
        with resources.as_file(resources.files("agent.arm").joinpath("j2s7s300.urdf")) as path:
            self.body = pybullet.loadURDF(
                str(path),
                basePosition=world_from_base[:3, 3].tolist(),
                baseOrientation=quaternion_from_matrix(world_from_base).tolist(),
                useFixedBase=True,
                flags=pybullet.URDF_USE_SELF_COLLISION | pybullet.URDF_USE_SELF_COLLISION_EXCLUDE_PARENT,
                physicsClientId=client,
            )
        index = {
            pybullet.getJointInfo(self.body, k, physicsClientId=client)[1].decode(): k
            for k in range(pybullet.getNumJoints(self.body, physicsClientId=client))
        }
        self.joints = [index[f"joint_{k}"] for k in range(1, JOINTS + 1)]
        self.fingers = [index[f"joint_finger_{k}"] for k in (1, 2, 3)]
        self.tips = [index[f"joint_finger_tip_{k}"] for k in (1, 2, 3)]
        self.hand, self.end_effector = self.joints[-1], index["joint_end_effector"]
        self.finger_links = frozenset(self.fingers + self.tips)
        self.weld: tuple[int, int] | None = None
        for link in self.finger_links:
            # Rubber-like pads, as on the real fingers; and spinning friction, so that thin things do not turn.
            pybullet.changeDynamics(
                self.body, link, lateralFriction=1.0, spinningFriction=0.01, jointDamping=0.02, physicsClientId=client
            )
        self.teleport(FOLDED, FINGER_OPEN)

    def teleport(self, q: np.ndarray, finger: float | None = None) -> None:
        """Set the joints (7,), and all fingers to one angle, at once and at rest; motors hold them there."""
        joints, values = list(self.joints), [[v] for v in q]
        if finger is not None:
            joints += self.fingers + self.tips
            values += [[finger]] * 3 + [[0.0]] * 3
        pybullet.resetJointStatesMultiDof(
            self.body, joints, values, [[0.0]] * len(joints), physicsClientId=self.client
        )
        self.command(q)
        if finger is not None:
            self.command_fingers([finger] * 3)

    def drop(self) -> None:
        """Ends the weld at once; whatever it held falls."""
        if self.weld is not None:
            pybullet.removeConstraint(self.weld[0], physicsClientId=self.client)
            self.weld = None

    def command(self, q: np.ndarray) -> None:
        """Let the position motors drive the arm joints towards q (7,)."""
        pybullet.setJointMotorControlArray(
            self.body,
            self.joints,
            pybullet.POSITION_CONTROL,
            targetPositions=list(q),
            targetVelocities=[0.0] * JOINTS,
            forces=list(EFFORT),
            positionGains=[0.3] * JOINTS,
            velocityGains=[1.0] * JOINTS,
            physicsClientId=self.client,
        )

    def command_fingers(self, angles: list[float], effort: float = FINGER_EFFORT) -> None:
        """Let the finger motors drive the three fingers towards `angles`; the tips, passive on the real hand, stay."""
        pybullet.setJointMotorControlArray(
            self.body,
            self.fingers + self.tips,
            pybullet.POSITION_CONTROL,
            targetPositions=list(angles) + [0.0] * 3,
            forces=[effort] * 3 + [FINGER_EFFORT] * 3,
            positionGains=[0.1] * 6,
            velocityGains=[1.0] * 6,
            physicsClientId=self.client,
        )

    def configuration(self) -> np.ndarray:
        """The arm's joint angles (7,) now."""
        return self._angles(self.joints)

    def finger_angles(self) -> np.ndarray:
        """The finger joint angles (3,) now: thumb, finger 2, finger 3."""
        return self._angles(self.fingers)

    def _angles(self, joints: list[int]) -> np.ndarray:
        states = pybullet.getJointStates(self.body, joints, physicsClientId=self.client)
        return np.array([state[0] for state in states])

    def world_from_ee(self) -> np.ndarray:
        """The hand's pose (4, 4) now, as the simulation has it."""
        state = pybullet.getLinkState(
            self.body, self.end_effector, computeForwardKinematics=True, physicsClientId=self.client
        )
        return pose_from_position_quaternion(np.array(state[4]), np.array(state[5]))

    def touching(self, body: int) -> set[int]:
        """The fingers (0 thumb, 1, 2) that press on `body` now."""
        contacts = pybullet.getContactPoints(self.body, body, physicsClientId=self.client)
        links = {contact[3] for contact in contacts if contact[9] > 0.0}
        return {k for k in range(3) if self.fingers[k] in links or self.tips[k] in links}
