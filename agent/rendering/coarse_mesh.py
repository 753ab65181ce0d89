"""Reduce a mesh to one that a page shows quickly."""

from __future__ import annotations

import numpy as np


def coarse_mesh(vertices: np.ndarray, faces: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Merge neighbouring vertices until few faces are left.

    Args:
        vertices: (V, 3), metres.
        faces: (F, 3) indices of vertices.
        most: the largest number of faces; a mesh with no more is returned as it is.

    Returns:
        Vertices (W, 3) and faces (G, 3), G <= `most`.
    """
    if len(faces) <= most:
        return vertices, faces
    low, size = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    cells = 64
    while cells > 1:
        merged = _merged(vertices, faces, low, size / cells)
        if len(merged[1]) <= most:
            return merged
        cells = cells * 3 // 4
    return vertices[:0], faces[:0]


def _merged(vertices: np.ndarray, faces: np.ndarray, low: np.ndarray, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Merge the vertices in each cube of a grid with this width into their mean; faces that collapse are dropped."""
    _, group = np.unique(np.floor((vertices - low) / cell).astype(int), axis=0, return_inverse=True)
    group = group.ravel()
    counts = np.bincount(group)
    means = np.stack([np.bincount(group, weights=vertices[:, axis]) / counts for axis in range(3)], axis=1)
    corners = group[faces]
    whole = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2]) & (corners[:, 2] != corners[:, 0])
    corners = corners[whole]
    _, first = np.unique(np.sort(corners, axis=1), axis=0, return_index=True)
    return means, corners[np.sort(first)]
