"""Join the inside of a vessel, which a camera sees over the near rim, to its outside."""

from __future__ import annotations

import numpy as np
import shapely

_RIMS = 0.02  # m that the outside ends above the inside at most; depth edges take more of it than of the inside
_WIDER = 1.15  # times the larger circle at most is the circle of both: what stands beside a vessel widens it more
_AT_WALL = 0.45  # of the radius is the outside's mean distance from the axis at least
_FOOT = 0.015  # m above the table, up to where the outside reaches down
_FACING = 0.3  # mean sine by which the walls face the axis, or away from it
_WALL = 0.7  # upward part of a normal from which on a surface is no wall
_LEAST_WALL = 10  # voxels


def vessels_closed(part: np.ndarray, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Give each part whose walls face inward to the part around it whose walls face outward.

    Only the inside of something faces its own axis; a thing that stands there would face away from it.

    Args:
        part: (V,) the part of each voxel, -1 for none.
        positions: (V, 3) above the table, metres, z up.
        normals: (V, 3) unit, toward the camera.
    """
    part = part.copy()
    parts = np.unique(part[part >= 0])
    for inside in parts:
        for outside in parts:
            inner, outer = part == inside, part == outside
            if inside != outside and inner.any() and outer.any() and _is_inside_of(inner, outer, positions, normals):
                part[inner] = outside
                break
    return part


def _is_inside_of(inner: np.ndarray, outer: np.ndarray, positions: np.ndarray, normals: np.ndarray) -> bool:
    """Return whether the voxels `inner` (V,) are the inside of what `outer` (V,) is the outside of."""
    if np.percentile(positions[outer, 2], 98) > np.percentile(positions[inner, 2], 98) + _RIMS:
        return False
    circles = [shapely.MultiPoint(positions[own, :2]) for own in (inner | outer, inner, outer)]
    radius, *alone = map(shapely.minimum_bounding_radius, circles)
    axis = shapely.minimum_bounding_circle(circles[0]).centroid
    center = np.array((axis.x, axis.y))
    if radius > _WIDER * max(alone):
        return False
    # What stands in the vessel is nearer to its axis than its wall, or does not reach down to the table.
    if np.linalg.norm(positions[outer, :2] - center, axis=1).mean() < _AT_WALL * radius:
        return False
    if np.percentile(positions[outer, 2], 5) > _FOOT:
        return False
    return (
        _facing(inner, positions, normals, center) > _FACING and _facing(outer, positions, normals, center) < -_FACING
    )


def _facing(own: np.ndarray, positions: np.ndarray, normals: np.ndarray, center: np.ndarray) -> float:
    """Return how much the walls among the voxels face an axis at `center` (2,): 1 toward it, -1 away; 0 without walls."""
    walls = own & (np.abs(normals[:, 2]) < _WALL)
    if walls.sum() < _LEAST_WALL:
        return 0.0
    toward = center - positions[walls, :2]
    toward /= np.maximum(np.linalg.norm(toward, axis=1, keepdims=True), 1e-9)
    return float((normals[walls, :2] * toward).sum(axis=1).mean())
