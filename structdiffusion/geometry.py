"""Rigid transforms: poses, rotations and quaternions.

Transforms are 4x4 matrices named `a_from_b`: they map points of frame b to frame a. Metres,
radians, right-handed, x forward, y left, z up (REP-103); quaternions are (x, y, z, w).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import overload

import numpy as np

# The heading in the world frame that each rotation token names.
HEADING_OF_ROTATION = {"north": 0.0, "west": math.pi / 2, "south": math.pi, "east": -math.pi / 2}


def pose_from_xyz_yaw(x: float, y: float, z: float, yaw: float) -> np.ndarray:
    """Return a transform (4, 4) that rotates by `yaw` about z, then moves by (x, y, z)."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z], [0, 0, 0, 1]], dtype=np.float64)


def pose_from_xyz_rpy(position: Sequence[float], angles: Sequence[float]) -> np.ndarray:
    """Return a transform (4, 4) that rotates about x, then y, then z, by three angles,
    then moves by a position (3,).
    """
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(angle), math.sin(angle)) for angle in angles)
    pose = np.eye(4)
    pose[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    pose[:3, 3] = position
    return pose


def transform_points(a_from_b: np.ndarray, points_b: np.ndarray) -> np.ndarray:
    """Transform points (..., 3) of frame b to frame a."""
    return points_b @ a_from_b[:3, :3].T + a_from_b[:3, 3]


def lengths(vectors: np.ndarray) -> np.ndarray:
    """Return the Euclidean lengths (...) of real vectors (..., K), to the bit those of `numpy.linalg.norm`.

    For millions of short vectors, numpy's takes several times as long, because it sums along the short axis.
    """
    squares = vectors[..., 0] ** 2
    for k in range(1, vectors.shape[-1]):
        squares = squares + vectors[..., k] ** 2
    return np.sqrt(squares)


def yaw_of(a_from_b: np.ndarray) -> float:
    """Return the rotation about z, in (-pi, pi], of a transform (4, 4) whose z axis stays up."""
    return math.atan2(a_from_b[1, 0], a_from_b[0, 0])


def yaws_of(a_from_b: np.ndarray) -> np.ndarray:
    """Return `yaw_of` each of the transforms (..., 4, 4), to the bit: (...)."""
    ends = zip(a_from_b[..., 1, 0].ravel().tolist(), a_from_b[..., 0, 0].ravel().tolist())
    return np.array([math.atan2(y, x) for y, x in ends]).reshape(a_from_b.shape[:-2])


@overload
def wrap_angle(angle: float) -> float: ...


@overload
def wrap_angle(angle: np.ndarray) -> np.ndarray: ...


def wrap_angle(angle: float | np.ndarray) -> float | np.ndarray:
    """Return the same angle in [-pi, pi)."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


def quaternion_from_matrix(matrix: np.ndarray) -> np.ndarray:
    """Return the unit quaternion (x, y, z, w) of a rotation matrix (3, 3) or transform (4, 4)."""
    m = np.asarray(matrix, dtype=np.float64)[:3, :3]
    # Shepperd's method: divide by the largest of the four candidates, so that it is never near 0.
    candidates = np.array([m[0, 0], m[1, 1], m[2, 2], np.trace(m)])
    k = int(candidates.argmax())
    q = np.empty(4)
    if k == 3:
        q[:] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], 1 + candidates[3]
    else:
        a, b, c = k, (k + 1) % 3, (k + 2) % 3
        q[a] = 1 + m[a, a] - m[b, b] - m[c, c]
        q[b] = m[b, a] + m[a, b]
        q[c] = m[c, a] + m[a, c]
        q[3] = m[c, b] - m[b, c]
    return q / np.linalg.norm(q)


def matrix_from_quaternion(quaternion: np.ndarray) -> np.ndarray:
    """Return the rotation matrix (3, 3) of a quaternion (x, y, z, w)."""
    x, y, z, w = np.asarray(quaternion, dtype=np.float64) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def pose_from_position_quaternion(position: np.ndarray, quaternion: np.ndarray) -> np.ndarray:
    """Return a transform (4, 4) from a position (3,) in metres and a quaternion (x, y, z, w)."""
    pose = np.eye(4)
    pose[:3, :3] = matrix_from_quaternion(quaternion)
    pose[:3, 3] = position
    return pose


def tilt_between(a: np.ndarray, b: np.ndarray) -> float:
    """Return the angle, radians, between the z axes of two rotations or transforms."""
    return math.acos(float(np.clip(a[:3, 2] @ b[:3, 2], -1.0, 1.0)))


def raised(pose: np.ndarray, height: float) -> np.ndarray:
    """Raise a pose by `height` metres."""
    moved = pose.copy()
    moved[2, 3] += height
    return moved


def turn_of(rotation: np.ndarray) -> float:
    """Return the angle, radians, of a rotation (3, 3) or of the rotation of a pose."""
    return float(np.arccos(np.clip((np.trace(rotation[:3, :3]) - 1) / 2, -1, 1)))
