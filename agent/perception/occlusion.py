"""Join the parts of one object that something in front of it divides."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from agent.perception.circle_fitting import circle_through
from agent.perception.color import differ

_LEAST = 30  # voxels of a part that is looked at
_FARTHEST = 0.12  # m between the parts
_WIDEST = 0.3  # m across both
_ALIKE = 12.0  # apart in CIELAB: one colour in light and shade
_AS_HIGH = 0.015  # m between their upper ends
_UPRIGHT, _LEAST_UPRIGHT = 0.4, 20  # upward part of a side's normal at most, and voxels of a side
_TURNED, _OFF = 0.97, 0.006  # cosine between the normals of one face, and m that its voxels lie off one plane
_OF_ONE_FACE = 0.6  # of a side's voxels have that normal
_RADII, _ROUND = (0.015, 0.12), 0.8  # m of an upright cylinder, and the mean cosine of its normals with the radius
_BETWEEN = np.linspace(0.15, 0.85, 6)  # places between two parts, from one to the other
_BESIDE = 0.008  # radians from the line of sight: two voxels at half a metre
_NEARER = 0.01  # m by which what hides a place is nearer than the place


def rejoined(
    part: np.ndarray, positions: np.ndarray, normals: np.ndarray, lab: np.ndarray | None, eye: np.ndarray
) -> np.ndarray:
    """Join parts that are as high, and between which something nearer hides everything, if they have one colour or are
    parts of one face or one cylinder: height alone is no evidence.

    Args:
        part: (V,) the part of each voxel, -1 for none.
        positions: (V, 3) level frame, metres.
        normals: (V, 3) unit, toward the camera.
        lab: (V, 3) colours in CIELAB, or `None`.
        eye: (3,) where the camera is.
    """
    part = part.copy()
    sight = positions - eye
    distance = np.linalg.norm(sight, axis=1)
    directions = cKDTree(sight / distance[:, None])
    large = [k for k, size in zip(*np.unique(part[part >= 0], return_counts=True), strict=True) if size >= _LEAST]
    top = {k: np.percentile(positions[part == k, 2], 95) for k in large}
    color = {} if lab is None else {k: np.median(lab[part == k], axis=0) for k in large}
    for place, one in enumerate(large):
        for other in large[place + 1 :]:
            if abs(top[one] - top[other]) > _AS_HIGH or differ(lab, part == one, part == other):
                continue
            own, its = positions[part == one], positions[part == other]
            if not len(own) or np.ptp(np.vstack((own, its))[:, :2], axis=0).max() > _WIDEST:
                continue
            away, nearest = cKDTree(its).query(own)
            first = int(away.argmin())
            if away[first] > _FARTHEST:
                continue
            alike = lab is not None and np.linalg.norm(color[one] - color[other]) <= _ALIKE
            if not alike and not _one_surface((own, normals[part == one]), (its, normals[part == other])):
                continue
            # At one height: the nearest voxels may be at the foot of both.
            between = own[first] + _BETWEEN[:, None] * (its[nearest[first]] - own[first])
            if _hidden(between, eye, directions, distance, (part != one) & (part != other)):
                part[part == one] = other
                break
    return part


def _one_surface(one: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]) -> bool:
    """Return whether the sides of two parts, each its positions and normals (V, 3), are one face or one cylinder."""
    sides = []
    for positions, normals in (one, other):
        upright = np.abs(normals[:, 2]) < _UPRIGHT
        if upright.sum() < _LEAST_UPRIGHT:
            return False
        level = normals[upright, :2] / np.linalg.norm(normals[upright, :2], axis=1, keepdims=True)
        sides.append((positions[upright, :2], level))
    return _one_face(*sides) or _one_cylinder(*sides)


def _one_face(one: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]) -> bool:
    """Return whether two sides, each its places and normals (V, 2) seen from above, have a face in one plane."""
    faces = []
    for places, normals in (one, other):
        main = normals.mean(axis=0) / max(float(np.linalg.norm(normals.mean(axis=0))), 1e-9)
        flat = normals @ main > _TURNED
        if flat.sum() < max(_LEAST_UPRIGHT, _OF_ONE_FACE * len(places)):
            return False
        faces.append((places[flat], main))
    (first, way), (second, its_way) = faces
    if way @ its_way < _TURNED:
        return False
    # Each counts alike, however much is seen of it.
    middle = (first.mean(axis=0) + second.mean(axis=0)) / 2
    scatter = sum((part - middle).T @ (part - middle) / len(part) for part in (first, second))
    normal = np.linalg.eigh(scatter)[1][:, 0]
    return all(np.sqrt(np.mean(((part - middle) @ normal) ** 2)) < _OFF for part in (first, second))


def _one_cylinder(one: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]) -> bool:
    """Return whether two sides, each its places and normals (V, 2) seen from above, lie on one circle."""
    places, normals = np.vstack((one[0], other[0])), np.vstack((one[1], other[1]))
    middle, radius = circle_through(places)
    if not _RADII[0] < radius < _RADII[1]:
        return False
    outward = places - middle
    away = np.linalg.norm(outward, axis=1)
    facing = (normals * outward).sum(axis=1) / np.maximum(away, 1e-9)
    halves = np.arange(len(places)) < len(one[0])
    return all(
        np.sqrt(np.mean((away[half] - radius) ** 2)) < _OFF and facing[half].mean() > _ROUND
        for half in (halves, ~halves)
    )


def _hidden(
    places: np.ndarray, eye: np.ndarray, directions: cKDTree, distance: np.ndarray, allowed: np.ndarray
) -> bool:
    """Return whether something hides every place (P, 3): a voxel (V,) of those allowed, near its line of sight."""
    sight = places - eye
    length = np.linalg.norm(sight, axis=1)
    found = directions.query_ball_point(sight / length[:, None], _BESIDE)
    return all(
        (allowed[near] & (distance[near] < far - _NEARER)).any() for near, far in zip(found, length, strict=True)
    )
