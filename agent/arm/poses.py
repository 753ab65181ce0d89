"""What is asked of poses (4, 4) of the hand and of objects."""

from __future__ import annotations

import numpy as np


def raised(pose: np.ndarray, height: float) -> np.ndarray:
    """The pose moved up by `height` metres."""
    moved = pose.copy()
    moved[2, 3] += height
    return moved


def turn_of(rotation: np.ndarray) -> float:
    """How far a rotation (3, 3), or that of a pose, turns, radians."""
    return float(np.arccos(np.clip((np.trace(rotation[:3, :3]) - 1) / 2, -1, 1)))
