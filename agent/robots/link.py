"""Define a way to one arm: what it reports, and what is asked of it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from agent.errors import RobotRefused
from agent.robots.trajectory import Grip, Trajectory

SUCCEEDED, CANCELED, REFUSED, FAILED = "succeeded", "canceled", "refused", "failed"


@dataclass(frozen=True)
class Outcome:
    """The end of a motion, as the arm's driver reports it.

    Attributes:
        kind: `SUCCEEDED`, `CANCELED`, `REFUSED` or `FAILED`.
        detail: the driver's words, or empty.
    """

    kind: str
    detail: str = ""


@dataclass(frozen=True)
class JointState:
    """The angles of joints by the names of the driver.

    Attributes:
        angles: rad as reported; NaN for what is no number.
        times: when each of them arrived, s of the link's clock.
    """

    angles: Mapping[str, float] = field(default_factory=dict)
    times: Mapping[str, float] = field(default_factory=dict)

    def since(self, names: Iterable[str]) -> float:
        """Return when the oldest of these angles arrived; minus infinity if one never did."""
        return min((self.times.get(name, -math.inf) for name in names), default=-math.inf)

    def of(self, names: Sequence[str]) -> np.ndarray:
        """Return the angles (n,) of these joints, in this order, whatever the order of the driver.

        Raises:
            RobotRefused: for a joint that is missing, or whose angle is not a finite number.
        """
        missing = [name for name in names if name not in self.angles]
        if missing:
            there = ", ".join(sorted(self.angles)) or "none"
            raise RobotRefused(f"the arm does not report {', '.join(missing)}; it reports: {there}")
        for name in names:
            if not math.isfinite(self.angles[name]):
                raise RobotRefused(f"the arm reports {self.angles[name]} for {name}; legal: a finite angle in radians")
        return np.array([self.angles[name] for name in names])


class Link(Protocol):
    """A way to one arm, with the clock by which it is watched. One motion is asked for at a time."""

    def connect(self) -> None:
        """Connect to the arm.

        Raises:
            RobotRefused: if it cannot be reached.
        """

    def state(self) -> JointState:
        """Return the last joint state."""

    def send(self, motion: Trajectory | Grip) -> None:
        """Ask for a motion, and return at once."""

    def outcome(self) -> Outcome | None:
        """Return how the last motion that was asked for ended; `None` while it lasts."""

    def cancel(self) -> str:
        """Ask the driver to stop the motion, and return at once; return why that was impossible, or an empty string."""

    def halt(self) -> str:
        """Stop the arm by whatever its driver has that is stronger; return what was done, or an empty string."""

    def trouble(self) -> str:
        """Return why the arm cannot be reached any more; empty while it can."""

    def now(self) -> float:
        """Return the time, s."""

    def wait(self, seconds: float) -> None:
        """Return after `seconds`, or earlier where something has arrived."""

    def close(self) -> None:
        """Disconnect."""
