"""Cluster the points above the table by Euclidean distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from structdiffusion.geometry import lengths

VOXEL = 0.004  # m
_STEEP = 5.7  # depth by width: a surface seen at ten degrees, at which no camera measures it well
_STEP = 0.004  # m of depth at 1 m: the noise and the steps of a Kinect, which grow with the square of the distance
_LARGE_STEP = 0.03  # m: more is no noise of any camera up to 2 m
_END = 0.15  # of a large step: what lies within that of one of its ends belongs to the surface there
_REACH = 2.5  # voxels within which two of them are neighbours; less than the finger's width between objects
_WIDEST_REACH = 0.018  # m
_STRAY = 3.0  # standard deviations of the distance to the neighbours, beyond which a voxel is a flying pixel
_NEIGHBOURS = 12
_BORDER = 4  # pixels
_STRAIGHT = 0.2  # of the rows begin there
_PATCH, _OF_PATCH = 0.015, 30  # m about a voxel, in which its surface is flat, and voxels there that are enough
_LEAST_OF_PATCH = 3  # voxels of a patch that has a normal; that of others is taken to be up
UP = (0.0, 0.0, 1.0)
_DENSE = 4  # voxels, itself among them, within reach of one inside a cluster


@dataclass(frozen=True)
class Voxels:
    """Points grouped into cubes.

    Attributes:
        positions: (V, 3) the mean of the points in each.
        of_point: (P,) the voxel of each point.
        count: (V,) the number of points in each.
        reach: metres within which two voxels are neighbours.
    """

    positions: np.ndarray
    of_point: np.ndarray
    count: np.ndarray
    reach: float

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Return the mean (V,) or (V, K) over each voxel of a value of every point."""
        if values.ndim == 1:
            return np.bincount(self.of_point, values, len(self.count)) / self.count
        return np.stack([self.mean(values[:, k]) for k in range(values.shape[1])], axis=1)


def gather(points: np.ndarray) -> Voxels:
    """Group points (P, 3), metres, into voxels of 4 mm, or larger if the points are farther apart than that."""
    some = points[:: max(1, len(points) // 2000)]
    apart = float(np.median(cKDTree(points).query(some, k=2)[0][:, 1]))
    size = max(VOXEL, 1.3 * apart)
    keys = np.floor((points - points.min(axis=0)) / size).astype(np.int64)
    extent = keys.max(axis=0) + 1
    _, of_point, count = np.unique(
        (keys[:, 0] * extent[1] + keys[:, 1]) * extent[2] + keys[:, 2], return_inverse=True, return_counts=True
    )
    positions = np.stack([np.bincount(of_point, points[:, k]) / count for k in range(3)], axis=1)
    return Voxels(positions, of_point, count, min(_REACH * size, max(_WIDEST_REACH, 1.5 * size)))


def bridging(points: np.ndarray) -> np.ndarray:
    """Return the pixels (H, W) at which the depth changes as steeply as at the edge of one surface before another.

    A camera often measures a slope there, which joins the two surfaces and the objects that they belong to.

    Args:
        points: (H, W, 3) camera frame, metres, NaN where nothing was measured.
    """
    distance = lengths(points)
    with np.errstate(invalid="ignore", divide="ignore"):
        sight = points / distance[..., None]
    steep = np.zeros(points.shape[:2], dtype=bool)
    for axis in (0, 1):
        ahead, behind = np.roll(points, -1, axis), np.roll(points, 1, axis)
        across = lengths((ahead - behind)[..., :2])
        with np.errstate(invalid="ignore"):
            steep |= np.abs(ahead[..., 2] - behind[..., 2]) > _STEEP * across + _STEP * points[..., 2] ** 2
        # Beside the camera's axis, a slope between two surfaces leans away from it, and would never seem steep: a large
        # step is measured along the line of sight. What lies at one end of the step is no slope but an edge: of a thing
        # a few pixels wide, nothing else would be left.
        across = lengths(np.roll(sight, -1, axis) - np.roll(sight, 1, axis)) * distance
        far, near = np.roll(distance, -1, axis), np.roll(distance, 1, axis)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = (distance - near) / (far - near)
            between = np.abs(share - 0.5) < 0.5 - _END
            steep |= between & (np.abs(far - near) > _STEEP * across + _LARGE_STEP)
    return steep


def at_border(points: np.ndarray) -> np.ndarray:
    """Return the pixels (H, W) at the border of the picture, or of the part of it in which the camera measures at all.

    Args:
        points: (H, W, 3) camera frame, metres, NaN where nothing was measured.
    """
    there = np.isfinite(points[..., 2])
    border = np.zeros(there.shape, dtype=bool)
    for turns in range(4):
        turned, marked = np.rot90(there, turns), np.rot90(border, turns)
        first = turned[turned.any(axis=1)].argmax(axis=1)
        # Where many rows begin at one column, that is where the sensor begins. Not so upright: there the far edge of a
        # table begins at one row too.
        at = int(first.min()) if len(first) and turns % 2 == 0 else 0
        begins = at if (first <= at + _BORDER).mean() > _STRAIGHT else 0
        marked[:, : begins + _BORDER] = True
    return border & there


def strays(voxels: Voxels) -> np.ndarray:
    """Return the voxels (V,) that lie much farther from their neighbours than the others do."""
    if len(voxels.positions) <= _NEIGHBOURS:
        return np.zeros(len(voxels.positions), dtype=bool)
    away = cKDTree(voxels.positions).query(voxels.positions, k=_NEIGHBOURS, workers=-1)[0].mean(axis=1)
    return away > away.mean() + _STRAY * away.std(ddof=1)


def clusters(positions: np.ndarray, reach: float) -> np.ndarray:
    """Return the cluster (V,) of each voxel, counted from 0; -1 for voxels with too few neighbours (DBSCAN)."""
    one, other = cKDTree(positions).query_pairs(reach, output_type="ndarray").T
    total = len(positions)
    core = 1 + np.bincount(one, minlength=total) + np.bincount(other, minlength=total) >= _DENSE
    joined = core[one] & core[other]
    edges = coo_array((np.ones(joined.sum(), dtype=bool), (one[joined], other[joined])), shape=(total, total))
    cluster = connected_components(edges, directed=False)[1].astype(np.int64)
    cluster[~core] = -1
    # A voxel at the border of two clusters belongs to the one that is found first.
    inner, border = np.where(core[one], one, other), np.where(core[one], other, one)
    at_edge = core[one] != core[other]
    first = np.full(total, total)
    np.minimum.at(first, border[at_edge], cluster[inner[at_edge]])
    cluster[first < total] = first[first < total]
    kept = cluster >= 0
    cluster[kept] = np.unique(cluster[kept], return_inverse=True)[1]
    return cluster


def normals(positions: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """Return unit normals (V, 3) of the surface at voxels (V, 3), toward the camera at `eye` (3,)."""
    away, nearest = cKDTree(positions).query(
        positions, k=min(_OF_PATCH, len(positions)), distance_upper_bound=_PATCH, workers=-1
    )
    there = np.isfinite(away).reshape(len(positions), -1)
    nearest = nearest.reshape(there.shape)
    # About each voxel itself: sums of squares of places far from the origin would lose digits.
    about = positions[np.where(there, nearest, np.arange(len(positions))[:, None])] - positions[:, None]
    count = there.sum(axis=1)
    mean = about.sum(axis=1) / count[:, None]
    spread = np.einsum("vki,vkj->vij", about, about) / count[:, None, None] - mean[:, :, None] * mean[:, None, :]
    found = np.linalg.eigh(spread)[1][:, :, 0]
    found[count < _LEAST_OF_PATCH] = UP
    return np.where(((eye - positions) * found).sum(axis=1)[:, None] < 0, -found, found)
