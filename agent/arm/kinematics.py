"""Compute forward and inverse kinematics of a mounted arm.

By default it is the Jaco, whose base stands at the world origin and is turned by 90 degrees about z, so that its usual
workspace (the base's -y side) lies at world +x. In the `end_effector` frame the approach direction is +z and the hand
closes along x, the first finger at +x. n is the number of the arm's joints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from agent.arm.arm_model import DEFAULT_MODEL, END_EFFECTOR, WORLD_FROM_BASE, ArmModel, arm_model

LOWERED = 0.01  # m below the table


@dataclass(frozen=True, eq=False)
class Kinematics:
    """The kinematics of an arm at its mounting place.

    Attributes:
        model: the model of the arm.
        world_from_base: (4, 4) where its base stands, upright.
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
    twice = rotation[:, (2, 0, 1), (1, 2, 0)] - rotation[:, (1, 2, 0), (2, 0, 1)]
    skew = 0.5 * twice
    sine = np.linalg.norm(skew, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(rotation, axis1=1, axis2=2) - 1.0))
    return skew * (angle / np.maximum(sine, 1e-9))[:, None]
