"""Compute mass properties of convex parts, and write the shape files that the physics engine loads.

The physics engine loads a concave body from a Wavefront file with one group per convex part. The files are named by a
digest of their content, and each file in use is written once.
"""

from __future__ import annotations

import functools
import hashlib
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from structdiffusion.temporary_folders import SHAPES

# m: lower limit of the radius of gyration, which keeps contacts stable. Thin objects (3 mm for a fork about its long
# axis) spin faster than a 1/240 s step can follow.
MIN_GYRATION = 0.008
_MOST_SHAPES = 2000  # largest number of files, about 20 MB; a world loads a few dozen


@dataclass(frozen=True)
class MassProperties:
    """The mass distribution of a body.

    Attributes:
        object_from_inertial: (4, 4) the centre of mass and the principal axes in the object frame.
        inertia: (3,) principal moments of inertia, kg m^2.
        volume: m^3.
    """

    object_from_inertial: np.ndarray
    inertia: np.ndarray
    volume: float


def outward_faces(vertices: np.ndarray) -> np.ndarray:
    """Return triangles (F, 3) of the convex hull of `vertices` (V, 3), counter-clockwise from outside; read-only."""
    return _outward_faces(np.asarray(vertices, dtype=float).tobytes())


@functools.lru_cache(maxsize=1000)  # the mass properties and the shape file of a body ask for the same faces
def _outward_faces(content: bytes) -> np.ndarray:
    vertices = np.frombuffer(content).reshape(-1, 3)
    hull = ConvexHull(vertices)
    a, b, c = (vertices[hull.simplices[:, k]] for k in range(3))
    inward = np.einsum("fi,fi->f", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces = hull.simplices.copy()
    faces[inward] = faces[inward][:, ::-1]
    faces.setflags(write=False)
    return faces


def mass_properties(hulls: Sequence[np.ndarray], mass: float) -> MassProperties:
    """Compute the mass properties of a body of uniform density made of disjoint convex parts.

    Args:
        hulls: convex parts, each (V, 3), object frame, metres.
        mass: kilograms.
    """
    volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for vertices in hulls:
        # Tetrahedra from an inner point to every face: the integral of x x^T over one of volume v
        # is v / 20 (sum of p p^T + (sum of p)(sum of p)^T) over its corners p.
        faces = vertices[outward_faces(vertices)]
        inner = np.broadcast_to(vertices.mean(axis=0), (len(faces), 1, 3))
        corners = np.concatenate((inner, faces), axis=1)
        v = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6
        total = corners.sum(axis=1)
        volume += v.sum()
        first += (v[:, None] * total / 4).sum(axis=0)
        second += np.einsum("t,tki,tkj->ij", v / 20, corners, corners)
        second += np.einsum("t,ti,tj->ij", v / 20, total, total)
    center = first / volume
    covariance = second / volume - np.outer(center, center)
    spread, axes = np.linalg.eigh(covariance)
    if np.linalg.det(axes) < 0:
        axes[:, 0] = -axes[:, 0]
    inertia = mass * np.maximum(spread.sum() - spread, MIN_GYRATION**2)
    object_from_inertial = np.eye(4)
    object_from_inertial[:3, :3] = axes
    object_from_inertial[:3, 3] = center
    return MassProperties(object_from_inertial, inertia, float(volume))


def solid_content(hulls: Sequence[np.ndarray]) -> bytes:
    """Return the content of a Wavefront file with one group per convex part (V, 3)."""
    return _wavefront([(vertices, outward_faces(vertices)) for vertices in hulls])


def surface_content(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    """Return the content of a Wavefront file of one surface, with vertices (V, 3) and faces (F, 3)."""
    return _wavefront([(vertices, faces)])


def _wavefront(parts: Sequence[tuple[np.ndarray, np.ndarray]]) -> bytes:
    lines, offset = [], 1
    for k, (vertices, faces) in enumerate(parts):
        lines.append(f"o part{k}")
        lines += [f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in vertices.tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (faces + offset).tolist()]
        offset += len(vertices)
    return ("\n".join(lines) + "\n").encode()


def shape_file(content: bytes) -> Path:
    """Write the content of a Wavefront file where this process has not yet done so, and return its path."""
    path = _shape_folder() / f"{hashlib.sha256(content).hexdigest()[:32]}.obj"
    if path in _shapes:
        _shapes.move_to_end(path)
    else:
        try:
            path.write_bytes(content)
        except OSError as error:
            error.filename = str(path)  # the error of a full disk has no name
            raise
        _shapes[path] = None
        if len(_shapes) > _MOST_SHAPES:  # bodies completed for one scene are not needed again
            _shapes.popitem(last=False)[0].unlink(missing_ok=True)
    return path


_shapes: OrderedDict[Path, None] = OrderedDict()  # existing files, the most recently used last


@functools.cache
def _shape_folder() -> Path:
    """Return the folder of this process's shape files, which is removed with the process."""
    return SHAPES.make()
