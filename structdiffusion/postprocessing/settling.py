"""Set the objects of proposed goals down: upright, and on the table or on the object below.

A sampled height is off by millimetres, and two millimetres inside the table are a failure. How an
object stood says where its lowest point is; what lies below its goal was seen by the camera.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely

from structdiffusion.completion.estimate import OVERLAP, ObjectEstimate
from structdiffusion.footprints import overlap_depth
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points

_ON_TABLE = 0.018  # m: an object whose sampled lift is less stands on the table,
_COVERED = 0.025  # m: unless its outline reaches this far over another's, as on a plate's floor
_SINKS = 0.02  # m: a sampled lift this far below a hollow top means that it goes inside, as a bowl in a bowl
# m: released a little high does no harm, a little low is an intersection. How deep something sinks is known to a
# centimetre only; from 3 + 1 cm it still falls at less than the 1 m/s that would count as abnormal.
_ABOVE, _ABOVE_SUNK = 0.004, 0.01
_OPENING = 0.85  # of a vessel's outline: what has to go inside must be narrower


def settle(objects: Sequence[ObjectEstimate], motions: np.ndarray) -> np.ndarray:
    """Return the motions with every object upright and set down on the table or on the object below it.

    Args:
        objects: N estimates of the objects as they now stand on the table.
        motions: (N, 4, 4) as sampled, world frame.

    Returns:
        (N, 4, 4), each a turn about z and a shift.
    """
    moved = np.array([motion[:3, :3] @ thing.mean + motion[:3, 3] for thing, motion in zip(objects, motions)])
    lifts = moved[:, 2] - np.array([thing.mean[2] for thing in objects])
    settled = np.array(motions)
    outlines: dict[int, np.ndarray] = {}
    rests = np.zeros(len(objects))  # z at which each comes to rest; it is released a little higher
    for i in np.argsort(lifts):
        upright = pose_from_xyz_yaw(0.0, 0.0, 0.0, math.atan2(motions[i, 1, 0], motions[i, 0, 0]))
        upright[:2, 3] = moved[i, :2] - upright[:2, :2] @ objects[i].mean[:2]
        outline = objects[i].outline_after(upright)
        least = OVERLAP if lifts[i] > _ON_TABLE else _COVERED
        below = [j for j, other in outlines.items() if overlap_depth(outline, other) > least]
        if below:
            carrier = max(below, key=lambda j: rests[j] + objects[j].height)
            top = rests[carrier] + objects[carrier].height
            fits = _inside(outline, outlines[carrier])
            sinks = objects[carrier].hollow and fits and top - lifts[i] > _SINKS
            rests[i] = top
            if sinks:
                # A vessel tapers, and goes deeper than its rim would: the sampled lift knows. Anything else rests
                # on the highest of the carrier's points within its outline.
                seen = transform_points(settled[carrier], objects[carrier].points) - (0, 0, settled[carrier, 2, 3])
                under = seen[shapely.contains_xy(shapely.Polygon(outline), seen[:, :2]), 2]
                floor = rests[carrier] + max(under, default=0.0)
                rests[i] = lifts[i] if objects[i].hollow else min(max(floor, lifts[i]), top)
            upright[2, 3] = rests[i] + (_ABOVE_SUNK if sinks else _ABOVE)
        settled[i] = upright
        outlines[int(i)] = outline
    return settled


def _inside(inner: np.ndarray, vessel: np.ndarray) -> bool:
    """Return whether an outline (K, 2) fits into a vessel's opening, given the vessel's outline (L, 2)."""
    middle = vessel.mean(axis=0)
    return bool(shapely.Polygon(middle + _OPENING * (vessel - middle)).contains(shapely.Polygon(inner)))
