"""Describe the surfaces of bodies for pictures, and make those of boxes and cylinders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

# The corners of each side of a box, counter-clockwise from outside.
BOX_SIDES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
_SEGMENTS = 40  # of a cylinder's outline
_CREASE = 0.8  # cosine between a face and the mean of those around a corner: beyond it, an edge is there


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface of triangles in one colour, in the frame of its body. Lengths in metres.

    Attributes:
        vertices: (V, 3).
        faces: (F, 3) indices of vertices.
        color: RGB, each 0 to 1.
        gloss: how bright the lamp shines back from it, 0 to 1.
    """

    vertices: np.ndarray
    faces: np.ndarray
    color: tuple[float, float, float]
    gloss: float = 0.1

    @cached_property
    def normals(self) -> np.ndarray:
        """Return the outward unit normal at each corner of each face, (F, 3, 3), smooth except at edges."""
        corners = self.vertices[self.faces]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        of_vertex = np.zeros_like(self.vertices, dtype=float)
        for corner in range(3):  # larger faces weigh more
            np.add.at(of_vertex, self.faces[:, corner], across)
        flat, smooth = np.repeat(_unit(across)[:, None], 3, axis=1), _unit(of_vertex)
        bend = np.ones(len(self.vertices))
        np.minimum.at(bend, self.faces, (smooth[self.faces] * flat).sum(axis=2))
        return np.where((bend < _CREASE)[self.faces][..., None], flat, smooth[self.faces])


def box(low: Sequence[float], high: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices (8, 3) and faces (12, 3) of a box between two opposite corners (3,)."""
    ends = np.array((low, high), dtype=float)
    vertices = np.array([(ends[i, 0], ends[j, 1], ends[k, 2]) for k in (0, 1) for j in (0, 1) for i in (0, 1)])
    faces = [triangle for a, b, c, d in BOX_SIDES for triangle in ((a, b, c), (a, c, d))]
    return vertices, np.array(faces)


def cylinder(radius: float, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices (V, 3) and faces (F, 3) of a cylinder about z with its middle at the origin.

    Its ends have vertices of their own, so that their edges stay sharp.
    """
    turns = np.linspace(0.0, 2 * np.pi, _SEGMENTS, endpoint=False)
    ring = radius * np.stack((np.cos(turns), np.sin(turns)), axis=1)
    low, high = (np.column_stack((ring, np.full(_SEGMENTS, z))) for z in (-length / 2, length / 2))
    here = np.arange(_SEGMENTS)
    after = (here + 1) % _SEGMENTS
    above = _SEGMENTS
    side = [np.stack(three, axis=1) for three in ((here, after, after + above), (here, after + above, here + above))]
    inner = np.arange(1, _SEGMENTS - 1)
    end = np.stack((np.zeros_like(inner), inner, inner + 1), axis=1)
    faces = np.concatenate((*side, end[:, ::-1] + 2 * _SEGMENTS, end + 3 * _SEGMENTS))
    return np.concatenate((low, high, low, high)), faces


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
