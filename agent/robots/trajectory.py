"""Hold a motion of the arm's joints, and one of the fingers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A motion of the joints that begins and ends at rest.

    Attributes:
        purpose: what for, such as "reach mug 1".
        times: (T,) s, increasing from 0.
        positions: (T, n) rad, in the order of the joints from the base on.
    """

    purpose: str
    times: np.ndarray
    positions: np.ndarray

    @property
    def start(self) -> np.ndarray:
        """Return where it begins (n,)."""
        return self.positions[0]

    @property
    def goal(self) -> np.ndarray:
        """Return where it ends (n,)."""
        return self.positions[-1]

    @property
    def duration(self) -> float:
        """Return how long it takes, s."""
        return float(self.times[-1])

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the positions (S, n) at times (S,); before it begins and after it ends it rests."""
        columns = [np.interp(times, self.times, column) for column in self.positions.T]
        return np.stack(columns, axis=-1)

    def turned(self, angles: np.ndarray) -> Trajectory:
        """Return the same motion with (n,) rad added to all positions."""
        return replace(self, positions=self.positions + angles)

    def mean_velocities(self) -> np.ndarray:
        """Return (T, n) rad/s: at each point the mean velocity since the one before; at the first one, zero.

        A driver that plays velocities back, each until the time of its point, arrives at the last position with these.
        """
        speeds = np.diff(self.positions, axis=0) / np.diff(self.times)[:, None]
        return np.concatenate((np.zeros((1, self.positions.shape[1])), speeds))

    def velocities(self) -> np.ndarray:
        """Return (T, n) rad/s at the points, zero at both ends."""
        velocities = np.gradient(self.positions, self.times, axis=0)
        velocities[[0, -1]] = 0.0
        return velocities


@dataclass(frozen=True, eq=False)
class Grip:
    """A motion of the fingers.

    Attributes:
        purpose: what for, "close hand" or "open hand".
        angles: (m,) rad to which the fingers are driven.
    """

    purpose: str
    angles: np.ndarray
