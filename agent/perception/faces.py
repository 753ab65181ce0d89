"""Join pieces of one face: noise puts valleys into a flat surface, but not into the planes on both sides of them."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

_SUPPORT = 0.03  # m on both sides of a border: over so much the noise of single voxels evens out
_LEAST = 12  # voxels on each side that determine a plane
_ANGLE = 0.94  # cosine between the planes on both sides of noise
_OFF, _OFF_BY_NOISE = 0.003, 1.5  # m, and times the noise, from one side to the plane of the other


def faces_joined(pieces: np.ndarray, positions: np.ndarray, reach: float) -> np.ndarray:
    """Join neighbouring pieces whose surfaces continue in one plane; return them numbered from 0.

    Args:
        pieces: (V,) the piece of each voxel.
        positions: (V, 3) metres.
        reach: metres within which voxels are neighbours.
    """
    near = cKDTree(positions).query_pairs(reach, output_type="ndarray")
    pairs = pieces[near]
    across = pairs[:, 0] != pairs[:, 1]
    near, pairs = near[across], np.sort(pairs[across], axis=1)
    root = np.arange(int(pieces.max()) + 1)
    for one, other in np.unique(pairs, axis=0):
        border = near[(pairs == (one, other)).all(axis=1)]
        if _one_face(pieces == one, pieces == other, positions[np.unique(border)], positions):
            root[root == root[one]] = root[other]
    return np.unique(root[pieces], return_inverse=True)[1]


def _one_face(one: np.ndarray, other: np.ndarray, border: np.ndarray, positions: np.ndarray) -> bool:
    """Return whether a plane goes on from voxels `one` (V,) to voxels `other` (V,) at their border (B, 3)."""
    tree = cKDTree(border)
    sides = []
    for own in (one, other):
        mine = positions[own]
        mine = mine[tree.query(mine, distance_upper_bound=_SUPPORT)[0] < _SUPPORT]
        if len(mine) < _LEAST:
            return False
        sides.append((mine, *_plane(mine)))
    (first, middle, normal, noise), (second, its_middle, its_normal, its_noise) = sides
    if abs(normal @ its_normal) < _ANGLE:
        return False
    most = max(_OFF, _OFF_BY_NOISE * max(noise, its_noise))
    off = np.median(np.abs((second - middle) @ normal)), np.median(np.abs((first - its_middle) @ its_normal))
    return bool(max(off) < most)


def _plane(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the middle (3,), the normal (3,), and the standard deviation from the plane, of points (P, 3)."""
    middle = points.mean(axis=0)
    values, vectors = np.linalg.eigh((points - middle).T @ (points - middle) / len(points))
    return middle, vectors[:, 0], float(np.sqrt(max(values[0], 0.0)))
