"""Compute joint paths: straight lines of the hand, and motor set points along a path.

A path is (T, n) joint angles in radians; n is the number of the arm's joints. Times in seconds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from agent.arm.kinematics import Kinematics
from structdiffusion.geometry import raised

CARTESIAN_STEP = 0.01  # m between the states of a straight line
LARGEST_JUMP = 0.35  # rad that a joint may turn between two of them
WAYPOINTS = 20  # poses of the hand on a way on which it turns


def straight_line(
    kinematics: Kinematics, start: np.ndarray, poses: Sequence[np.ndarray], step: float = CARTESIAN_STEP
) -> np.ndarray | None:
    """Return the joint path (T, n) that leads the hand from configuration `start` (n,) straight through the hand
    poses.

    Args:
        kinematics: the kinematics of the arm.
        start: the configuration at the start of the line.
        poses: the pose (4, 4) at `start`, then those to reach; only the position moves between two
            poses of equal rotation.

    Returns:
        The path from `start` on, or `None` if a joint limit or a jump of more than `LARGEST_JUMP`
        comes between.
    """
    path = [np.asarray(start, dtype=np.float64)]
    for before, after in zip(poses, poses[1:]):
        count = max(1, math.ceil(float(np.linalg.norm(after[:3, 3] - before[:3, 3])) / step))
        for k in range(1, count + 1):
            pose = after.copy()
            pose[:3, 3] = before[:3, 3] + (after[:3, 3] - before[:3, 3]) * k / count
            q, solved = kinematics.inverse(pose[None], path[-1][None], iterations=25)
            if not solved[0] or np.abs(q[0] - path[-1]).max() > LARGEST_JUMP:
                return None
            path.append(q[0])
    return np.array(path)


def straight_lines(
    kinematics: Kinematics, starts: np.ndarray, poses: np.ndarray, directions: np.ndarray, length: float
) -> list[np.ndarray]:
    """Return the joint path (T, n) of a straight line for each of B hands, as far as it can be followed.

    The hands do not turn. All states are solved at once; after a limit or a jump, the rest is solved state by state.

    Args:
        kinematics: the kinematics of the arm.
        starts: (B, n) the configurations at the start of the lines, and poses: (B, 4, 4) of the hand there.
        directions: (B, 3) unit vectors.
        length: metres; a state every `CARTESIAN_STEP`.
    """
    count = math.ceil(length / CARTESIAN_STEP)
    targets = np.repeat(poses[:, None], count, axis=1)
    distances = np.arange(1, count + 1) * length / count
    targets[:, :, :3, 3] += distances[:, None] * directions[:, None]
    q, solved = kinematics.inverse(targets.reshape(-1, 4, 4), np.repeat(starts, count, axis=0), iterations=25)
    paths = np.concatenate((starts[:, None], q.reshape(len(starts), count, -1)), axis=1)
    good = solved.reshape(len(starts), count) & (np.abs(np.diff(paths, axis=1)).max(axis=2) <= LARGEST_JUMP)
    lines = []
    for path, reached, target in zip(paths, good.cumprod(axis=1).sum(axis=1), targets, strict=True):
        line = list(path[: 1 + reached])
        for pose in target[reached:]:
            again, found = kinematics.inverse(pose[None], line[-1][None], iterations=25)
            if not found[0] or np.abs(again[0] - line[-1]).max() > LARGEST_JUMP:
                break
            line.append(again[0])
        lines.append(np.array(line))
    return lines


def level_path(kinematics: Kinematics, start: np.ndarray, goal: np.ndarray, rise: float) -> np.ndarray | None:
    """Return the joint path (T, n) on which the hand moves straight, and turns about the vertical alone if it can.

    What hangs between two fingers swings out of them when the hand tilts.

    Args:
        kinematics: the kinematics of the arm.
        start, goal: (n,).
        rise: metres that the hand is lifted first, and lowered in the end.

    Returns:
        The path, or `None` if it is out of reach, or does not end in `goal`.
    """
    first, last = kinematics.forward(np.stack((start, goal)))
    turn = Rotation.from_matrix(last[:3, :3] @ first[:3, :3].T).as_rotvec()
    poses = [first]
    for share in np.linspace(0.0, 1.0, WAYPOINTS + 1):
        pose = raised(first, rise)
        pose[:3, :3] = Rotation.from_rotvec(share * turn).as_matrix() @ first[:3, :3]
        pose[:3, 3] += share * (last - first)[:3, 3]
        poses.append(pose)
    path = straight_line(kinematics, start, [*poses, last])
    if path is None or np.abs(kinematics.unwind(goal, path[-1]) - path[-1]).max() > LARGEST_JUMP:
        return None
    return np.concatenate((path[:-1], kinematics.unwind(goal, path[-1])[None]))


def interpolate(path: np.ndarray, step: float) -> np.ndarray:
    """Return the path (T, n) with states added so that no joint moves more than `step` between two."""
    pieces = [path[:1]]
    for a, b in zip(path, path[1:]):
        count = max(1, math.ceil(float(np.abs(b - a).max()) / step))
        pieces.append(a + (b - a) * (np.arange(1, count + 1)[:, None] / count))
    return np.concatenate(pieces)


def trajectory(path: np.ndarray, period: float, velocity: np.ndarray, smoothing: float = 0.2) -> np.ndarray:
    """Return set points (T, n), one per `period` seconds: the path as fast as `velocity` (n,), rad/s, allows.

    A moving average over `smoothing` seconds rounds the corners and eases in and out.
    """
    durations = (np.abs(np.diff(path, axis=0)) / velocity).max(axis=1)
    times = np.concatenate(([0.0], np.cumsum(durations)))
    samples = np.arange(0.0, times[-1] + period, period)
    points = np.stack([np.interp(samples, times, path[:, k]) for k in range(path.shape[1])], axis=1)
    width = max(1, round(smoothing / period))
    padded = np.concatenate((np.repeat(path[:1], width, axis=0), points, np.repeat(path[-1:], width, axis=0)))
    sums = np.cumsum(np.concatenate((np.zeros((1, path.shape[1])), padded)), axis=0)
    return np.concatenate(((sums[width:] - sums[:-width]) / width, path[-1:]))
