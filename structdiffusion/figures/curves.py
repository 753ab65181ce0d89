"""Plane curves: lengths along them, samples of them, the distance between them, the similarity between points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np


def arc_lengths(curve: np.ndarray) -> np.ndarray:
    """Return how far (P,) each point of a curve (P, 2) is along it."""
    return np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))))


def diameter(points: np.ndarray) -> float:
    """Return the largest distance between two of some points (N, 2)."""
    return float(np.linalg.norm(points[:, None] - points, axis=-1).max())


def sampled(curves: Sequence[np.ndarray], step: float) -> np.ndarray:
    """Return points (S, 2) along curves (P, 2), at most `step` apart; a curve of one point gives it."""
    found = []
    for curve in curves:
        found.append(curve[:1])
        for a, b in pairwise(curve):
            count = max(1, math.ceil(float(np.linalg.norm(b - a)) / step))
            found.append(a + (b - a) * (np.arange(1, count + 1) / count)[:, None])
    return np.concatenate(found)


def chamfer(one: np.ndarray, other: np.ndarray) -> float:
    """Return the Chamfer distance of points (S, 2) and (T, 2): the mean of both mean distances to the nearest point."""
    distances = np.linalg.norm(one[:, None] - other, axis=-1)
    return float(distances.min(axis=1).mean() + distances.min(axis=0).mean()) / 2


def similarity(source: np.ndarray, target: np.ndarray) -> tuple[float, float, np.ndarray]:
    """Return the scale, angle (rad) and shift (2,) of the least-squares similarity, which does not mirror.

    Args:
        source: (N, 2) points, two or more of them different.
        target: (N, 2) where they go: scale * (source turned by the angle) + shift.
    """
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    x, y = a.T @ b  # sums of products of x, and of y, with both target coordinates
    cosine, sine = float(x[0] + y[1]), float(x[1] - y[0])
    scale = math.hypot(cosine, sine) / max(float((a**2).sum()), 1e-12)
    angle = math.atan2(sine, cosine)
    return scale, angle, target.mean(axis=0) - moved(source.mean(axis=0)[None], scale, angle, np.zeros(2))[0]


def moved(points: np.ndarray, scale: float, angle: float, shift: np.ndarray) -> np.ndarray:
    """Return points (N, 2) scaled, turned by an angle (rad), and shifted."""
    c, s = math.cos(angle), math.sin(angle)
    return scale * points @ np.array([[c, s], [-s, c]]) + shift
