"""Close gaps that noise put into a surface: from farther away on both sides, no valley and no step is there."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from agent.perception.color import differ

_NEAREST, _FARTHEST = 0.012, 0.025  # m between the two voxels, one on each side, that are compared across a gap
_LEAST = 40  # such pairs
_VALLEY, _VALLEY_IN_COLOR = -0.46, -0.32  # lean of the surfaces at a quarter of a gap; less where colours differ
_STEP = 0.3  # sine from which on, in the median, one surface lies before the other


def gaps_closed(
    pieces: np.ndarray, positions: np.ndarray, normals: np.ndarray, lab: np.ndarray | None, reach: float
) -> np.ndarray:
    """Join neighbouring pieces whose surfaces continue without a valley or a step; return them numbered from 0.

    Args:
        pieces: (V,) the piece of each voxel.
        positions: (V, 3) metres.
        normals: (V, 3) unit, toward the camera.
        lab: (V, 3) colours in CIELAB, or `None`.
        reach: metres within which voxels are neighbours.
    """
    near = pieces[cKDTree(positions).query_pairs(reach, output_type="ndarray")]
    gaps = np.unique(np.sort(near[near[:, 0] != near[:, 1]], axis=1), axis=0)
    root = np.arange(int(pieces.max()) + 1)
    for one, other in gaps:
        first, second = np.flatnonzero(pieces == one), np.flatnonzero(pieces == other)
        valley = _VALLEY_IN_COLOR if differ(lab, first, second) else _VALLEY
        if _continues(first, second, positions, normals, valley):
            root[root == root[one]] = root[other]
    return np.unique(root[pieces], return_inverse=True)[1]


def _continues(one: np.ndarray, other: np.ndarray, positions: np.ndarray, normals: np.ndarray, valley: float) -> bool:
    """Return whether the surface of some voxels goes on to others without a valley or a step."""
    tree = cKDTree(positions[other])
    one = one[tree.query(positions[one], distance_upper_bound=_FARTHEST)[0] < _FARTHEST]
    found = cKDTree(positions[one]).sparse_distance_matrix(tree, _FARTHEST, output_type="coo_matrix")
    far = found.data > _NEAREST
    if far.sum() < _LEAST:
        return False
    here, there = one[found.row[far]], other[found.col[far]]
    across = (positions[here] - positions[there]) / found.data[far, None]
    lean = ((normals[here] - normals[there]) * across).sum(axis=1)
    joint = normals[here] + normals[there]
    joint /= np.maximum(np.linalg.norm(joint, axis=1, keepdims=True), 0.1)
    return bool(np.percentile(lean, 25) > valley and np.median(np.abs((joint * across).sum(axis=1))) < _STEP)
