"""Divide surfaces at concave edges: where one object stands on another, or beside it, the surfaces meet in a valley.

Voxels are grouped into small patches of one direction. Two patches meet in a valley if their normals lean toward each
other; they do not meet if one lies before the other, as under an overhang. Patches are then merged pair by pair, the
pair whose whole common border is the most convex first, until only valleys are left between them: a border is judged
as a whole, so that noise in one place of it joins and cuts nothing.
"""

from __future__ import annotations

import heapq

import numpy as np
from scipy.spatial import cKDTree

_PATCH = 0.018  # m across
_TURN = 0.9  # patches across, by which normals that differ by 60 degrees are apart
_ROUNDS = 3
_TOLERANCE = 0.22  # of lean: 12 degrees, what noise and the smoothing of normals do to a flat surface
_MOST_VALLEY, _MOST_RIDGE = -0.7, 0.35  # lean of one patch against another counts no more than this
_OBLIQUE, _STEPS_COUNT = 0.35, 1.5  # sine from which on one patch lies before another, and what the rest of it counts
_COLOR_COUNTS = 0.1  # of lean: what another colour counts; less than the tolerance, so that no print divides a face
_ALIKE = 15.0  # apart in CIELAB: one colour in light and shade
_SHORT = 8.0  # pairs of voxels by which every border is taken to be longer and neither convex nor concave


def convex_pieces(
    positions: np.ndarray, normals: np.ndarray, reach: float, lab: np.ndarray | None = None
) -> np.ndarray:
    """Return the piece (V,) of each voxel, counted from 0: parts of the surface without a valley in them.

    Args:
        positions: (V, 3) metres.
        normals: (V, 3) unit, toward the camera.
        reach: metres within which voxels are neighbours.
        lab: (V, 3) colours in CIELAB: where the colour changes, a slighter valley is enough.
    """
    patch = _patches(positions, normals)
    count = int(patch.max()) + 1
    middle, facing = _means(patch, positions), _means(patch, normals)
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-9)
    near = patch[cKDTree(positions).query_pairs(reach, output_type="ndarray")]
    near = np.sort(near[near[:, 0] != near[:, 1]], axis=1)
    borders, length = np.unique(near, axis=0, return_counts=True)
    across = middle[borders[:, 0]] - middle[borders[:, 1]]
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9)
    lean = ((facing[borders[:, 0]] - facing[borders[:, 1]]) * across).sum(axis=1)
    joint = facing[borders[:, 0]] + facing[borders[:, 1]]
    joint /= np.maximum(np.linalg.norm(joint, axis=1, keepdims=True), 1e-9)
    step = np.maximum(np.abs((joint * across).sum(axis=1)) - _OBLIQUE, 0.0)
    convex = np.maximum(np.clip(lean, -1.0, _MOST_RIDGE) - _STEPS_COUNT * step, _MOST_VALLEY) + _TOLERANCE
    if lab is not None:
        shades = _means(patch, lab)
        change = np.linalg.norm(shades[borders[:, 0]] - shades[borders[:, 1]], axis=1)
        convex -= _COLOR_COUNTS * np.clip((change - _ALIKE) / _ALIKE, 0.0, 1.0)
    return _merged(count, borders, length, length * convex)[patch]


def _patches(positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the patch (V,) of each voxel: k-means over places and directions."""
    features = np.hstack((positions / _PATCH, _TURN * normals))
    cell = np.floor(positions / _PATCH).astype(np.int64)
    cell -= cell.min(axis=0)
    extent = cell.max(axis=0) + 1
    _, patch = np.unique((cell[:, 0] * extent[1] + cell[:, 1]) * extent[2] + cell[:, 2], return_inverse=True)
    for _ in range(_ROUNDS):
        _, patch = cKDTree(_means(patch, features)).query(features)
        _, patch = np.unique(patch, return_inverse=True)
    return patch


def _means(group: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the mean (G, K) of values (V, K) over each group."""
    count = np.bincount(group)
    return np.stack([np.bincount(group, values[:, k]) / count for k in range(values.shape[1])], axis=1)


def _merged(count: int, borders: np.ndarray, length: np.ndarray, convex: np.ndarray) -> np.ndarray:
    """Merge patches as long as any border is convex as a whole; return the piece (count,) of each patch.

    Args:
        count: of patches.
        borders: (B, 2) the patches on both sides.
        length: (B,) how long each border is.
        convex: (B,) how convex it is, summed over its length.
    """
    sides: list[dict[int, tuple[float, float]]] = [{} for _ in range(count)]
    heap = []
    for (one, other), long, sum_ in zip(borders.tolist(), length.tolist(), convex.tolist(), strict=True):
        sides[one][other] = sides[other][one] = (sum_, long)
        if sum_ > 0:
            heap.append((-sum_ / (long + _SHORT), one, other))
    heapq.heapify(heap)
    root = np.arange(count)
    while heap:
        priority, one, other = heapq.heappop(heap)
        border = sides[one].get(other)
        if border is None or -border[0] / (border[1] + _SHORT) != priority:
            continue  # merged meanwhile, or changed by a merge
        if len(sides[one]) < len(sides[other]):
            one, other = other, one
        root[root == other] = one
        for third, (sum_, long) in sides[other].items():
            del sides[third][other]
            if third == one:
                continue
            had = sides[one].get(third, (0.0, 0.0))
            joint = (sum_ + had[0], long + had[1])
            sides[one][third] = sides[third][one] = joint
            if joint[0] > 0:
                heapq.heappush(heap, (-joint[0] / (joint[1] + _SHORT), one, third))
        sides[other] = {}
    return np.unique(root, return_inverse=True)[1]
