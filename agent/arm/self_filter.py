"""Compute distances of points to an arm in its recorded pose, to find the points that belong to the arm itself."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from agent.arm.arm_model import ArmModel, Solid, arm_model
from agent.arm.jaco_hand import FINGER_OPEN, FINGERS
from agent.arm.state import ArmState
from agent.errors import BadInput
from structdiffusion.geometry import transform_points

CHUNK = 8_192  # points at once, so that they stay in the processor's cache
SLACK = 2e-3  # m


def distance_to_arm(points: np.ndarray, arm: ArmState) -> np.ndarray:
    """Return distances (P,), metres, of points (P, 3) in the frame `link_base` to the arm, including its hand and
    fingers.

    The distance is 0 inside a solid and NaN for a point that is NaN. Fingers missing from the recording are assumed to
    be open.

    Raises:
        BadInput: for an unknown model, or when a joint of the arm is missing or not a number.
    """
    model = arm_model(arm.model)
    angles = dict.fromkeys(FINGERS, FINGER_OPEN) | dict(arm.joints)
    missing = [name for name in model.joints if not np.isfinite(angles.get(name, np.nan))]
    if missing:
        raise BadInput(
            f"the recording does not say how {', '.join(missing)} of its {model.name} stood; "
            f"needed: {', '.join(model.joints)}"
        )
    return distance_to_solids(points, model, angles)


def distance_to_solids(points: np.ndarray, model: ArmModel, angles: Mapping[str, float]) -> np.ndarray:
    """Return distances (P,), metres, of points (P, 3) in the frame of the base to an arm whose joints are at `angles`.

    The distance is 0 inside a solid and NaN for a point that is NaN.
    """
    poses = model.link_poses(angles)
    placed = [(solid, poses[solid.link] @ solid.link_from_solid) for solid in model.solids]
    points = np.asarray(points, dtype=np.float64)
    pieces = [_distances(points[k : k + CHUNK], placed) for k in range(0, len(points), CHUNK)]
    return np.concatenate(pieces) if pieces else np.empty(0)


def _distances(points: np.ndarray, placed: list[tuple[Solid, np.ndarray]]) -> np.ndarray:
    """Return the same for a few points, to solids with their poses (4, 4)."""
    single = points.astype(np.float32)
    centers = np.array([pose[:3, 3] for _, pose in placed], dtype=np.float32)
    radii = np.array([_bounding_radius(solid) for solid, _ in placed], dtype=np.float32)
    # |p - c|^2 = |p|^2 - 2 p c + |c|^2 is quick; what it loses by cancelling is below the slack.
    squares = (centers**2).sum(axis=1)[:, None] - 2.0 * centers @ single.T + (single**2).sum(axis=1)
    away = np.sqrt(np.maximum(squares, 0.0))
    nearest = (away + radii[:, None]).min(axis=0).astype(np.float64) + SLACK
    least = away - (radii + SLACK)[:, None]
    for k in np.argsort(least.mean(axis=1)):
        solid, pose = placed[k]
        near = np.flatnonzero(least[k] < nearest)
        if len(near):
            inside = transform_points(np.linalg.inv(pose), points[near])
            nearest[near] = np.minimum(nearest[near], _distance(inside, solid))
    return nearest


def _bounding_radius(solid: Solid) -> float:
    if solid.round:
        return float(np.hypot(solid.sides[0], solid.sides[2]) / 2)
    return float(np.linalg.norm(solid.sides) / 2)


def _distance(points: np.ndarray, solid: Solid) -> np.ndarray:
    """Return distances (P,) of points (P, 3) in the solid's own frame."""
    if solid.round:
        beside = np.hypot(points[:, 0], points[:, 1]) - solid.sides[0] / 2
        above = np.abs(points[:, 2]) - solid.sides[2] / 2
        return np.hypot(np.maximum(beside, 0.0), np.maximum(above, 0.0))
    return np.linalg.norm(np.maximum(np.abs(points) - solid.sides / 2, 0.0), axis=1)
