"""Thin a cloud, and find the plane that holds most of its points."""

from __future__ import annotations

import numpy as np

_HYPOTHESES = 400  # of RANSAC for each plane: finds one that holds a quarter of the points with near certainty
_JUDGES = 4_000  # points that every hypothesis is tried on; the best ones are tried on all
_BEST = 16
_CHUNK = 500_000  # points that are sorted into cells at once


def thinned(points: np.ndarray, cell: float) -> np.ndarray:
    """Return the mean (V, 3) float64 of the points (P, 3) in each occupied cube of `cell` metres, all finite."""
    corner = points.min(axis=0) - cell / 2
    extent = np.floor((points.max(axis=0) - corner) / cell).astype(np.int64) + 1
    keys, sums = np.empty(0, np.int64), np.empty((0, 4))
    for start in range(0, len(points), _CHUNK):
        some = points[start : start + _CHUNK]
        x, y, z = np.floor((some - corner) / cell).astype(np.int64).T
        own, of_point = np.unique((x * extent[1] + y) * extent[2] + z, return_inverse=True)
        each = [np.bincount(of_point, weights) for weights in (*some.T, None)]
        # Cells that several chunks share are added up.
        keys, place = np.unique(np.concatenate((keys, own)), return_inverse=True)
        values = np.concatenate((sums, np.stack(each, axis=1)))
        sums = np.stack([np.bincount(place, values[:, k]) for k in range(4)], axis=1)
    return sums[:, :3] / sums[:, 3:]


def largest_plane(points: np.ndarray, within: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Find the plane that most points lie near, by RANSAC (Fischler and Bolles, 1981).

    Args:
        points: (P, 3) metres, at least 3.
        within: metres; points nearer than that to a plane are its inliers.
        rng: draws the hypotheses.

    Returns:
        The least-squares plane (4,) of the inliers, n . p + d = 0 with |n| = 1, and the inliers (P,) bool.
    """
    middle = points.mean(axis=0)
    centred = (points - middle).astype(np.float32)
    one, other, third = centred[rng.integers(len(points), size=(3, _HYPOTHESES))]
    normals = np.cross(other - one, third - one)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    offsets = (normals * one).sum(axis=1)
    judges = centred if len(points) <= _JUDGES else centred[rng.choice(len(points), _JUDGES, replace=False)]
    near = np.abs(judges @ normals.T - offsets) < within
    counts = np.where(lengths[:, 0] > 0, near.sum(axis=0), -1)  # three points of one line make no plane
    best = np.argsort(counts)[-_BEST:]
    exact = np.abs(centred @ normals[best].T - offsets[best]) < within
    inliers = exact[:, exact.sum(axis=0).argmax()]
    mine = points[inliers]
    center = mine.mean(axis=0)
    normal = np.linalg.eigh((mine - center).T @ (mine - center))[1][:, 0]
    return np.append(normal, -normal @ center), inliers
