"""Hold what an arm may do: the ranges and speeds of its joints, and where its hand may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.arm.arm_model import ArmModel
from agent.arm.kinematics import Kinematics
from agent.errors import RobotRefused
from agent.robots.trajectory import Trajectory

SPEED_SLACK = 1.01  # times are written with microseconds, so that a speed at its limit may be a little above it
RANGE_SLACK = 0.01  # rad


@dataclass(frozen=True, eq=False)
class JointLimits:
    """The joints of one arm, as its driver names them.

    Attributes:
        names: of the n joints, from the base on.
        lower, upper: (n,) rad, infinite for a joint that turns without limit.
        continuous: (n,) bool: whether it does.
        velocity: (n,) rad/s.
        fingers: the names of the joints of the hand that are commanded.
    """

    names: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    continuous: np.ndarray
    velocity: np.ndarray
    fingers: tuple[str, ...]

    @classmethod
    def of_arm(cls, model: ArmModel, prefix: str = "") -> JointLimits:
        """Return the maker's limits of an arm whose joints' names begin with `prefix`."""
        turning = model.continuous
        return cls(
            tuple(prefix + name for name in model.joints),
            np.where(turning, -np.inf, model.lower),
            np.where(turning, np.inf, model.upper),
            turning,
            model.velocity,
            tuple(prefix + name for name in model.fingers),
        )

    def difference(self, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Return one - other (..., n); of a joint that turns without limit the shorter way."""
        apart = np.asarray(one) - other
        return np.where(self.continuous, (apart + np.pi) % (2 * np.pi) - np.pi, apart)

    def check(self, trajectory: Trajectory) -> None:
        """Check a motion against the ranges and speeds.

        Raises:
            RobotRefused: if it leaves them, or is no motion of these joints at all.
        """
        times, positions = trajectory.times, trajectory.positions
        told = f"the motion {trajectory.purpose!r} is refused"
        if positions.shape[1:] != (len(self.names),) or len(times) != len(positions) or len(times) < 2:
            raise RobotRefused(
                f"{told}: it has {len(times)} times and positions of shape {positions.shape}; legal: two points or "
                f"more of {len(self.names)} joints"
            )
        if not (np.isfinite(times).all() and np.isfinite(positions).all()):
            raise RobotRefused(f"{told}: it has a number that is not finite")
        if times[0] != 0.0 or (np.diff(times) <= 0.0).any():
            raise RobotRefused(f"{told}: its times do not increase from 0")
        beyond = np.maximum(self.lower - positions, positions - self.upper)
        if beyond.max() > RANGE_SLACK:
            at, joint = np.unravel_index(beyond.argmax(), beyond.shape)
            raise RobotRefused(
                f"{told}: {self.names[joint]} would be at {positions[at, joint]:.3f} rad; legal: "
                f"{self.lower[joint]:.3f} to {self.upper[joint]:.3f} rad"
            )
        speeds = np.abs(np.diff(positions, axis=0)) / np.diff(times)[:, None]
        if (speeds > SPEED_SLACK * self.velocity).any():
            at, joint = np.unravel_index((speeds / self.velocity).argmax(), speeds.shape)
            raise RobotRefused(
                f"{told}: {self.names[joint]} would turn at {speeds[at, joint]:.3f} rad/s; legal: at most "
                f"{self.velocity[joint]:.3f} rad/s"
            )


@dataclass(frozen=True, eq=False)
class Workspace:
    """A box that the hand of an arm may not leave, world frame.

    Attributes:
        kinematics: of the arm at its mounting place.
        low, high: (3,) m.
    """

    kinematics: Kinematics
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def above(cls, table: Sequence[float], kinematics: Kinematics, margin: float = 0.3) -> Workspace:
        """Return the space above a table (x_min, x_max, y_min, y_max) and the arm's base.

        Args:
            margin: m that it reaches beyond both, to every side.
        """
        base = kinematics.world_from_base[:2, 3]
        low = np.minimum((table[0], table[2]), base) - margin
        high = np.maximum((table[1], table[3]), base) + margin
        return cls(kinematics, np.array((*low, 0.0)), np.array((*high, 1.3)))

    def check(self, trajectory: Trajectory) -> None:
        """Check that the hand stays inside.

        Raises:
            RobotRefused: if it does not.
        """
        places = self.kinematics.forward(trajectory.positions)[:, :3, 3]
        outside = np.maximum(self.low - places, places - self.high)
        if outside.max() > 0.0:
            at = int(outside.max(axis=1).argmax())
            place, low, high = (
                ", ".join(f"{each:.2f}" for each in point) for point in (places[at], self.low, self.high)
            )
            raise RobotRefused(
                f"the motion {trajectory.purpose!r} is refused: the hand would be at ({place}) m; legal: ({low}) to "
                f"({high}) m"
            )
