"""Estimate an object's properties from its partial cloud: outline, height, and whether others can stand on it.

The geometric planner, the settling of proposed goals and the checks before execution use these estimates, never the
true models.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from structdiffusion.footprints import outline_centroid, outline_centroids, overlap_depths, turned, turned_by_each
from structdiffusion.geometry import yaws_of
from structdiffusion.observation import ObjectCloud
from structdiffusion.structures.bodies import LayoutItem, PlacedBody

# m: points this close below the highest count as near the top; about four standard deviations of the noise
_LEVEL = 0.008
_TOP = 0.005  # m: points this close below the top belong to it; a ball has few of them
_STACKABLE_SHARE = 0.45  # share of the outline's area that a top has to span to carry something
_RIM, _RIM_NOISE = 0.985, 0.003  # quantile of the points at the height of a rim; m that noise adds to it
_WALL_NOISE = 0.002  # m: the same for a vessel, whose rim has few points; a tower accumulates such errors
# Of the cells within 12 mm of a level top, most are less than 5.5 mm below it, studs included; it is three quarters for
# the ridge of a banana, and two thirds for a ball. Units: m, m, m (side of a cell), share of the cells.
_NEAR_TOP, _BELOW_TOP, _CELL, _LEVEL_SHARE = 0.0055, 0.012, 0.004, 0.82
_INNER = 0.5  # share of the outline's smallest radius within which a vessel is lower than its rim
_ON_TABLE = 0.008  # m: objects that are lifted less stand on the table
# m: two objects side by side whose estimated tops differ by less may carry one together.
_EQUALLY_HIGH = 0.012
# m: outlines that overlap less belong to neighbours that touch, not to objects on top of each other.
OVERLAP = 0.005


@dataclass(frozen=True)
class ObjectEstimate:
    """One partly seen object that stands on the table, in the world frame, metres.

    Attributes:
        name, category: of its cloud.
        points: (P, 3) its observed points.
        mean: (3,) the mean of its points.
        outline: (K, 2) convex outline seen from above.
        height: of its level top.
        front_yaw: heading of its front, computed as for cutlery.
        stackable: whether its top is level and wide enough to carry something.
        rounded: whether its top slopes down to all sides, as on a fruit, so that nothing can stand on it.
        hollow: whether the camera sees into it: a bowl, cup, pan or plate, into which another object may sink.
    """

    name: str
    category: str
    points: np.ndarray
    mean: np.ndarray
    outline: np.ndarray
    height: float
    front_yaw: float
    stackable: bool
    hollow: bool
    rounded: bool = False

    def layout_item(self) -> LayoutItem:
        """Return the object as the geometric planner sees it. The unseen bottom is assumed to be level."""
        centred = self.outline - outline_centroid(self.outline)
        return LayoutItem(self.category, centred, self.height, self.front_yaw, self.stackable, flat_bottom=True)

    def outline_after(self, motion: np.ndarray) -> np.ndarray:
        """Return the outline (K, 2) after an upright motion (4, 4) in the world frame."""
        return turned(self.outline, math.atan2(motion[1, 0], motion[0, 0])) + motion[:2, 3]


def estimate(cloud: ObjectCloud) -> ObjectEstimate:
    """Estimate the properties of an object from its partial cloud."""
    outline = outline_of(cloud.points[:, :2].astype(np.float64))
    z = cloud.points[:, 2]
    height, hollow = top_of(cloud.points, outline)
    mean = cloud.points.mean(axis=0).astype(np.float64)
    top = _level_or_rim(z) if hollow else height  # the correction for noise at a rim applies to the height alone
    try:
        # In 2-d, volume is area.
        share = ConvexHull(cloud.points[z > top - _TOP, :2]).volume / ConvexHull(outline).volume
    except (QhullError, ValueError):
        share = 0.0
    rounded = not hollow and _level_share(cloud.points, height) < _LEVEL_SHARE
    return ObjectEstimate(
        cloud.name,
        cloud.category,
        cloud.points.astype(np.float64),
        mean,
        outline,
        height,
        front_yaw(cloud.points),
        bool(share > _STACKABLE_SHARE) and not rounded,
        hollow,
        rounded,
    )


def top_of(points: np.ndarray, outline: np.ndarray) -> tuple[float, bool]:
    """Return the height of the level top or rim, metres, and whether the camera sees into the object.

    Args:
        points: (P, 3) seen points of the object, which stands at z = 0.
        outline: (K, 2) convex outline of the same points.
    """
    z = points[:, 2]
    height = _level_or_rim(z)
    middle = outline_centroid(outline)
    inner = np.linalg.norm(points[:, :2] - middle, axis=1) < _INNER * np.linalg.norm(outline - middle, axis=1).min()
    hollow = bool(inner.sum() >= 5 and height - float(np.median(z[inner])) > _LEVEL)
    # The points near a vessel's top are mostly on the wall below the rim.
    return (float(np.quantile(z, _RIM)) - _WALL_NOISE if hollow else height), hollow


def _level_or_rim(z: np.ndarray) -> float:
    """Return the height of a top from the heights (P,) of all points.

    Noise lifts the highest points above a level top, so the median of the points near them is used. The narrow rim of a
    can, on which other objects stand, is higher than its lid.
    """
    level = float(np.median(z[z > np.quantile(z, 0.97) - _LEVEL]))
    return max(level, float(np.quantile(z, _RIM)) - _RIM_NOISE)


def outline_of(points: np.ndarray) -> np.ndarray:
    """Return the convex outline (K, 2) of points (P, 2). Depth noise is along the ray, so mostly vertical."""
    try:
        return points[ConvexHull(points).vertices]
    except (QhullError, ValueError):  # fewer than three points, or all on one line
        return points.mean(axis=0) + 0.005 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def _level_share(points: np.ndarray, height: float) -> float:
    """Return the share of the points seen from above (P, 3) within 12 mm of a top that belong to that top."""
    cells = np.floor(points[:, :2] / _CELL).astype(np.int64)
    near, below = (np.unique(cells[points[:, 2] > height - depth], axis=0) for depth in (_NEAR_TOP, _BELOW_TOP))
    return len(near) / max(1, len(below))


def front_yaw(points: np.ndarray) -> float:
    """Return the heading of the long axis toward its wider end: the tines, blade or bowl of cutlery."""
    centred = points[:, :2] - points[:, :2].mean(axis=0)
    axis = np.linalg.svd(centred, full_matrices=False)[2][0]
    along, across = centred @ axis, centred @ np.array([-axis[1], axis[0]])
    middle = 0.5 * (along.min() + along.max())
    if np.std(across[along < middle]) > np.std(across[along >= middle]):
        axis = -axis
    return math.atan2(axis[1], axis[0])


def imagined_bodies(objects: Sequence[ObjectEstimate], motions: np.ndarray) -> list[PlacedBody]:
    """Return the proposed structure as estimated bodies, for the checks before anything has moved.

    Args:
        objects: N estimates.
        motions: (N, 4, 4) upright motions, world frame.
    """
    return imagined_structures(objects, motions[None])[0]


def imagined_structures(objects: Sequence[ObjectEstimate], motions: np.ndarray) -> list[list[PlacedBody]]:
    """Return K proposed structures as estimated bodies, each as `imagined_bodies` does.

    Args:
        objects: N estimates.
        motions: (K, N, 4, 4) upright motions, world frame.
    """
    turns = yaws_of(motions)
    bodies_of: list[list[PlacedBody]] = [[] for _ in motions]
    everywhere = []
    for i, thing in enumerate(objects):
        outlines = turned_by_each(thing.outline, turns[:, i]) + motions[:, i, None, :2, 3]
        centroids = outline_centroids(outlines)
        everywhere.append(outlines)
        for k, bodies in enumerate(bodies_of):
            lift, yaw = float(motions[k, i, 2, 3]), thing.front_yaw + float(turns[k, i])
            bodies.append(
                PlacedBody(thing.name, thing.category, outlines[k], centroids[k], lift, lift + thing.height, yaw)
            )
    stacked = motions[..., 2, 3] >= _ON_TABLE
    overlapping = np.zeros((len(motions), len(objects), len(objects)), dtype=bool)
    for i, j in itertools.combinations(range(len(objects)), 2):
        rows = np.flatnonzero(stacked[:, i] | stacked[:, j])  # where neither is stacked, nothing asks
        depths = overlap_depths(everywhere[i][rows], everywhere[j][rows])
        overlapping[rows, i, j] = overlapping[rows, j, i] = depths > OVERLAP
    return [_resting(bodies, table) for bodies, table in zip(bodies_of, overlapping.tolist())]


def _resting(bodies: list[PlacedBody], overlapping: Sequence[Sequence[bool]]) -> list[PlacedBody]:
    """Return bodies that know which others carry them: the highest below, and those beside it about as high.

    Args:
        bodies: the N bodies.
        overlapping: (N, N) whether the outlines of two of them overlap, where one of them is stacked.
    """
    order = sorted(range(len(bodies)), key=lambda i: bodies[i].z_bottom)
    for rank, upper in enumerate(order):
        if bodies[upper].z_bottom < _ON_TABLE:
            continue
        below = [lower for lower in order[:rank] if overlapping[upper][lower]]
        if below:
            carrier = max(below, key=lambda lower: bodies[lower].z_top)
            beside = (
                lower
                for lower in below
                if lower != carrier
                and bodies[lower].z_top > bodies[carrier].z_top - _EQUALLY_HIGH
                and lower not in bodies[carrier].rests_on
            )
            bodies[upper] = replace(bodies[upper], rests_on=(carrier, *beside))
    return bodies
