"""Set the objects of proposed goals down: upright, and on the table or on the object below.

A sampled height is off by millimetres, and two millimetres inside the table are a failure. How an
object stood says where its lowest point is; what lies below its goal was seen by the camera.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import shapely

from structdiffusion.completion.estimate import OVERLAP, ObjectEstimate
from structdiffusion.footprints import overlap_depths, turned_by_each
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points

_ON_TABLE = 0.018  # m: an object whose sampled lift is less stands on the table,
_COVERED = 0.025  # m: unless its outline reaches this far over another's, as on a plate's floor
_SINKS = 0.02  # m: a sampled lift this far below a hollow top means that it goes inside, as a bowl in a bowl
# m: released a little high does no harm, a little low is an intersection. How deep something sinks is known to a
# centimetre only; from 3 + 1 cm it still falls at less than the 1 m/s that would count as abnormal.
_ABOVE, _ABOVE_SUNK = 0.004, 0.01
_OPENING = 0.85  # of a vessel's outline: what has to go inside must be narrower


def settle_each(objects: Sequence[ObjectEstimate], motions: np.ndarray) -> np.ndarray:
    """Return K proposals with every object upright and set down on the table or on the object below it.

    Args:
        objects: N estimates of the objects as they now stand on the table.
        motions: (K, N, 4, 4) as sampled, world frame.

    Returns:
        (K, N, 4, 4), each a turn about z and a shift.
    """
    upright, lifts = np.empty_like(motions, dtype=np.float64), np.empty(motions.shape[:2])
    outlines = []  # of each object: (K, L, 2)
    for i, thing in enumerate(objects):
        for k, motion in enumerate(motions[:, i]):
            moved = motion[:3, :3] @ thing.mean + motion[:3, 3]
            upright[k, i] = pose_from_xyz_yaw(0.0, 0.0, 0.0, math.atan2(motion[1, 0], motion[0, 0]))
            upright[k, i, :2, 3] = moved[:2] - upright[k, i, :2, :2] @ thing.mean[:2]
            lifts[k, i] = moved[2] - thing.mean[2]
        yaws = np.array([math.atan2(pose[1, 0], pose[0, 0]) for pose in upright[:, i]])
        outlines.append(turned_by_each(thing.outline, yaws) + upright[:, i, None, :2, 3])
    depths = np.zeros((len(motions), len(objects), len(objects)))
    for i, j in itertools.combinations(range(len(objects)), 2):
        depths[:, i, j] = depths[:, j, i] = overlap_depths(outlines[i], outlines[j])
    for k in range(len(motions)):
        _set_down(objects, upright[k], lifts[k], [each[k] for each in outlines], depths[k])
    return upright


def _set_down(
    objects: Sequence[ObjectEstimate],
    motions: np.ndarray,
    lifts: np.ndarray,
    outlines: Sequence[np.ndarray],
    depths: np.ndarray,
) -> None:
    """Set one proposal down from the lowest object up, in place.

    Args:
        objects: N estimates.
        motions: (N, 4, 4) upright; their heights are written.
        lifts: (N,) of the objects as sampled, metres.
        outlines: N outlines (L, 2) at the goals.
        depths: (N, N) by how far the outlines overlap, metres.
    """
    rests = np.zeros(len(objects))  # z at which each comes to rest; it is released a little higher
    placed: list[int] = []
    for i in np.argsort(lifts).tolist():
        least = OVERLAP if lifts[i] > _ON_TABLE else _COVERED
        below = [j for j in placed if depths[i, j] > least]
        if below:
            carrier = max(below, key=lambda j: rests[j] + objects[j].height)
            top = rests[carrier] + objects[carrier].height
            fits = _inside(outlines[i], outlines[carrier])
            sinks = objects[carrier].hollow and fits and top - lifts[i] > _SINKS
            rests[i] = top
            if sinks:
                # A vessel tapers, and goes deeper than its rim would: the sampled lift knows. Anything else rests
                # on the highest of the carrier's points within its outline.
                seen = transform_points(motions[carrier], objects[carrier].points) - (0, 0, motions[carrier, 2, 3])
                under = seen[shapely.contains_xy(shapely.Polygon(outlines[i]), seen[:, :2]), 2]
                floor = rests[carrier] + max(under, default=0.0)
                rests[i] = lifts[i] if objects[i].hollow else min(max(floor, lifts[i]), top)
            motions[i, 2, 3] = rests[i] + (_ABOVE_SUNK if sinks else _ABOVE)
        placed.append(i)


def _inside(inner: np.ndarray, vessel: np.ndarray) -> bool:
    """Return whether an outline (K, 2) fits into a vessel's opening, given the vessel's outline (L, 2)."""
    middle = vessel.mean(axis=0)
    return bool(shapely.Polygon(middle + _OPENING * (vessel - middle)).contains(shapely.Polygon(inner)))
