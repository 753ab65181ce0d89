"""A short refinement of imagined arrangements: into the contract's bands where they hardly miss them, and apart.

What a network samples is right to about a centimetre. A band of sizes or gaps can be missed by less than that, and so
can the free space between two rims. The outlines that the camera saw tell how far to move; where nothing is wrong,
nothing moves.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import shapely

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import ObjectEstimate, imagined_bodies
from structdiffusion.footprints import CLEARANCE, fit_circle, separation_along, tightest_ring_radius
from structdiffusion.geometry import HEADING_OF_ROTATION, pose_from_xyz_yaw, wrap_angle
from structdiffusion.protocol.semantic import OFF_LINE, PlacedBody, allowed_off_ring, allowed_unevenness
from structdiffusion.tableware import CUTLERY

# Extent over tightest extent, inside the contract's bands (1 to 1.3, 1.3 to 1.8, 1.8 and more). The sides that the camera
# does not see make outlines too narrow rather than too broad: lower margins are wider. Small structures keep a clear gap.
_RATIO = {"small": (1.0, 1.2), "medium": (1.45, 1.68), "large": (2.05, np.inf)}
_KEPT = 0.6  # of what the contract lets rings and rows be off: what is off by more is drawn in
_GAP = 0.006  # m of clear gap that neighbours are parted to: the unseen side of an object may reach a little farther
_SKEW = math.radians(8.0)  # that cutlery may be off; the contract allows 15 degrees
_ROUNDS = 8


def straightened(objects: Sequence[ObjectEstimate], motions: np.ndarray, spec: StructureSpec) -> np.ndarray:
    """The motions, with a circle or line of the size asked for, as round, straight and even as it has to be.

    Args:
        objects: N estimates.
        motions: (N, 4, 4) set down (`settle`), world frame.
        spec: what was asked for.
    """
    bodies = imagined_bodies(objects, motions)
    result = motions.copy()
    if spec.shape == "circle" and len(bodies) >= 3:
        result[:, :2, 3] += _to_ring(bodies, spec.size)
    if spec.shape == "line" and len(bodies) >= 2 and not any(body.rests_on for body in bodies):
        result[:, :2, 3] += _to_row(bodies, spec.size)
    return result


def pointed(objects: Sequence[ObjectEstimate], motions: np.ndarray, spec: StructureSpec, heading: float) -> np.ndarray:
    """The motions, with the cutlery of a table setting turned to point away from the diner.

    Which end of a fork is its front shows in the outline of its cloud, where the network may have mistaken it.

    Args:
        objects: N estimates.
        motions: (N, 4, 4) set down (`settle`), world frame.
        spec: what was asked for; its rotation goes before `heading`.
        heading: that the sampled structure faces, toward the diner, radians.
    """
    if spec.shape != "table setting":
        return motions
    result = motions.copy()
    away = (HEADING_OF_ROTATION[spec.rotation] if spec.rotation else heading) + math.pi
    for index, body in enumerate(imagined_bodies(objects, motions)):
        if body.category in CUTLERY:
            off = wrap_angle(body.front_yaw - away)
            turn = pose_from_xyz_yaw(0.0, 0.0, 0.0, float(np.clip(off, -_SKEW, _SKEW) - off))
            turn[:2, 3] = body.centroid - turn[:2, :2] @ body.centroid
            result[index] = turn @ result[index]
    return result


def parted(objects: Sequence[ObjectEstimate], others: Sequence[ObjectEstimate], motions: np.ndarray) -> np.ndarray:
    """The motions, with a clear gap between whatever stands on the table. What rests on something goes with it.

    Args:
        objects: N estimates; others: of the distractors, which stay.
        motions: (N, 4, 4) set down (`settle`), world frame.
    """
    bodies = imagined_bodies(objects, motions)
    group = list(range(len(bodies)))  # the lowest of what stands on one another
    for index in sorted(group, key=lambda i: bodies[i].z_bottom):
        if bodies[index].rests_on:
            group[index] = group[bodies[index].rests_on[0]]
    roots = sorted(set(group))
    outlines = {root: bodies[root].footprint for root in roots}
    fixed = [other.outline for other in others]
    moved = {root: np.zeros(2) for root in roots}
    for _ in range(_ROUNDS):
        still = True
        for a, b in itertools.combinations(roots, 2):
            push = _push(outlines[a] + moved[a], outlines[b] + moved[b])
            if push is not None:
                moved[a], moved[b], still = moved[a] - push / 2, moved[b] + push / 2, False
        for root, outline in itertools.product(roots, fixed):
            push = _push(outline, outlines[root] + moved[root])
            if push is not None:
                moved[root], still = moved[root] + push, False
        if still:
            break
    result = motions.copy()
    result[:, :2, 3] += [moved[group[i]] for i in range(len(bodies))]
    return result


def _push(still: np.ndarray, moving: np.ndarray) -> np.ndarray | None:
    """How far (2,) the second outline (L, 2) has to go from the first (K, 2), along the line of their middles."""
    middle, other = still.mean(axis=0), moving.mean(axis=0)
    between = other - middle
    apart = float(np.linalg.norm(between))
    reach = np.linalg.norm(still - middle, axis=1).max() + np.linalg.norm(moving - other, axis=1).max()
    if apart >= reach + _GAP:
        return None
    if shapely.distance(shapely.Polygon(still), shapely.Polygon(moving)) >= _GAP - 1e-4:
        return None
    direction = between / apart if apart > 1e-6 else np.array([0.0, 1.0])
    needed = separation_along(still - middle, moving - other, direction, _GAP)
    return max(0.0, needed - apart) * direction


def _to_ring(bodies: Sequence[PlacedBody], size: str | None) -> np.ndarray:
    """How far (N, 2) each object moves, along its radius."""
    centre, radius = fit_circle(np.array([body.centroid for body in bodies]))
    offsets = np.array([body.centroid for body in bodies]) - centre
    distances = np.linalg.norm(offsets, axis=1)
    directions = offsets / distances[:, None]
    tightest = tightest_ring_radius([body.local_footprint for body in bodies], directions)
    wanted = _in_band(radius, tightest, size)
    most = _KEPT * allowed_off_ring(wanted)
    return (wanted + np.clip(distances - radius, -most, most) - distances)[:, None] * directions


def _to_row(bodies: Sequence[PlacedBody], size: str | None) -> np.ndarray:
    """How far (N, 2) each object moves, along the line and across it."""
    points = np.array([body.centroid for body in bodies])
    middle = points.mean(axis=0)
    direction = np.linalg.svd(points - middle)[2][0]
    normal = np.array([-direction[1], direction[0]])
    along, across = (points - middle) @ direction, (points - middle) @ normal
    order = np.argsort(along)
    outlines = [bodies[i].local_footprint for i in order]
    tight = np.array([separation_along(one, other, direction) for one, other in zip(outlines, outlines[1:])])
    spread = np.diff(along[order]) - tight  # beyond the tightest
    for _ in range(_ROUNDS):  # the mean goes along with what is drawn in
        most = _KEPT * allowed_unevenness(spread.mean() + CLEARANCE)
        spread = spread.mean() + np.clip(spread - spread.mean(), -most, most)
    extent, tightest = float((tight + spread).sum()), float(tight.sum())
    # Every gap changes by the same length: clear gaps that were even stay even.
    spread += (_in_band(extent, tightest, size) - extent) / len(spread)
    new_along = np.concatenate(([0.0], np.cumsum(tight + spread)))
    new_along += 0.5 * (along[order[0]] + along[order[-1]] - new_along[-1])
    moves = np.empty((len(bodies), 2))
    moves[order] = (new_along - along[order])[:, None] * direction
    return moves + (np.clip(across, -_KEPT * OFF_LINE, _KEPT * OFF_LINE) - across)[:, None] * normal


def _in_band(extent: float, tightest: float, size: str | None) -> float:
    """The extent nearest to this one that lies in the band of a size, if one was asked for."""
    low, high = _RATIO[size] if size is not None else (0.0, np.inf)
    return float(np.clip(extent, low * tightest, high * tightest))
