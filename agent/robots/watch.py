"""Judge joint states while an arm moves: is it where it should be, and is the state fresh?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.robots.limits import JointLimits
from agent.robots.link import JointState
from agent.robots.trajectory import Trajectory

PATH_STEP = 0.05  # s between the points of the planned path that a state is compared with


@dataclass(frozen=True)
class Tolerances:
    """What is still taken for as planned.

    Attributes:
        at_rest: rad between a joint and where it should rest, before and after a motion.
        off_path: rad between a joint and the planned path on the way.
        lag, lead: s by which the arm may be behind or ahead of its plan: drivers answer late, and report ten times a
            second.
        stale: s without a joint state.
        late: s that a result may take beyond twice the duration: kinova-ros corrects what it has missed for so long.
        settle: s after the result in which the last joint state may still show the way.
        stopping: s after a cancel in which the arm has to stand still and the driver to answer.
        still: rad by which the joints of an arm that stands may differ, in 0.2 s.
        finger: rad between a finger and where it should be.
    """

    at_rest: float = 0.05
    off_path: float = 0.12
    lag: float = 0.6
    lead: float = 0.15
    stale: float = 0.25
    late: float = 4.0
    settle: float = 1.0
    stopping: float = 1.0
    still: float = 0.01
    finger: float = 0.1


def stale_trouble(state: JointState, limits: JointLimits, now: float, tolerances: Tolerances) -> str:
    """Return that no state has come for too long; empty if one has."""
    age = now - state.since(limits.names)
    return f"no joint state came for {age:.2f} s (legal: {tolerances.stale} s)" if age > tolerances.stale else ""


def rest_trouble(joints: np.ndarray, planned: np.ndarray, limits: JointLimits, tolerance: float) -> str:
    """Return which joint (n,) is not where it should rest, with its value and the planned one; empty if none is.

    The turns of a joint that turns without limit do not count. Degrees are recognised.
    """
    apart = np.abs(limits.difference(joints, planned))
    worst = int(apart.argmax())
    if apart[worst] <= tolerance:
        return ""
    told = f"{limits.names[worst]} stands at {joints[worst]:.3f} rad, planned: {planned[worst]:.3f} rad"
    in_radians = np.abs(limits.difference(np.radians(joints), planned))
    if in_radians.max() <= tolerance:
        return f"{told}; all joints would be as planned if the arm reported degrees, but radians are needed"
    beyond = (joints < limits.lower - tolerance) | (joints > limits.upper + tolerance)
    if beyond.any():
        joint = int(beyond.argmax())
        told = (
            f"{limits.names[joint]} stands at {joints[joint]:.3f} rad, which it cannot; legal: "
            f"{limits.lower[joint]:.3f} to {limits.upper[joint]:.3f} rad, planned: {planned[joint]:.3f} rad"
        )
        if (np.abs(joints) > 2 * np.pi).any():
            told += "; are these degrees? Radians are needed"
    return told


def path_trouble(
    joints: np.ndarray, elapsed: float, trajectory: Trajectory, limits: JointLimits, tolerances: Tolerances
) -> str:
    """Return which joint (n,) has left the planned path, `elapsed` s after it began; empty if none has."""
    first, last = np.clip((elapsed - tolerances.lag, elapsed + tolerances.lead), 0.0, trajectory.duration)
    path = trajectory.at(np.linspace(first, last, 2 + int((last - first) / PATH_STEP)))
    apart = np.abs(limits.difference(joints, path))
    nearest = apart.max(axis=1).argmin()
    worst = int(apart[nearest].argmax())
    if apart[nearest, worst] <= tolerances.off_path:
        return ""
    return (
        f"{limits.names[worst]} is at {joints[worst]:.3f} rad, planned: {path[nearest, worst]:.3f} rad "
        f"({apart[nearest, worst]:.3f} rad off its path, legal: {tolerances.off_path})"
    )
