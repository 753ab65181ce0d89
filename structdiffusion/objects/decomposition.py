"""Decompose a mesh into convex parts with V-HACD, cached on disk by the mesh's content.

Physics needs convex bodies, and a bowl has to stay hollow. The cache is in `$XDG_CACHE_HOME/structagent`
(`~/.cache/structagent` by default); if it cannot be written, decomposition only takes longer. Cached parts are
bit-identical to computed ones: one rounded digit would change where an object settles, and with it every goal that is
sampled later.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import vhacdx
from scipy.spatial import ConvexHull, QhullError

from structdiffusion.limits import DISTANCES_AT_ONCE

MAX_PARTS = 24
MAX_PART_VERTICES = 32
# An object that is a single convex body may have more vertices than the parts of other objects.
MAX_SINGLE_VERTICES = 64
# m: 95 % of the surface of an object that is treated as convex lies this close to its hull.
_CONVEX_WITHIN = 0.004
RESOLUTION = 80_000
# Part of every cache key: increase it if the same mesh should give different parts.
_VERSION = 3
# Largest size of the arrays of a cache entry, bytes: 24 parts of 32 vertices take 18 kB.
_LARGEST_ENTRY = 4_000_000
# m^3: parts of a smaller volume are artefacts of the voxel grid.
_SMALLEST_PART = 1e-9


def cache_directory() -> Path:
    """Return the folder of the cache; it may not exist yet."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "structagent" / "decompositions"


def convex_parts(
    vertices: np.ndarray,
    faces: np.ndarray,
    *,
    max_parts: int = MAX_PARTS,
    resolution: int = RESOLUTION,
) -> tuple[np.ndarray, ...]:
    """Split a surface into convex parts, each (V, 3) with V <= 32, in the mesh's own frame.

    A mesh of which 95 % of the surface lies within 4 mm of its hull is returned as that one hull, with up to 64
    vertices. The result is the same whether it is computed or comes from the cache. Several processes may call this at
    once.

    Args:
        vertices: (V, 3) metres.
        faces: (F, 3) vertex indices.
        max_parts: the largest number of parts to return.
        resolution: the number of voxels of V-HACD; the cost grows with it.

    Raises:
        ValueError: if no part has a volume.
    """
    vertices = np.ascontiguousarray(vertices, dtype=np.float64)
    faces = np.ascontiguousarray(faces, dtype=np.uint32)
    if (single := _single_part(vertices, faces, max_parts)) is not None:
        return (single,)
    digest = hashlib.sha256(f"{_VERSION} {max_parts} {resolution}".encode())
    digest.update(vertices.tobytes())  # not rounded: different meshes have different parts
    digest.update(faces.tobytes())
    path = cache_directory() / f"{digest.hexdigest()[:32]}.npz"
    stored = _read(path, max_parts)
    if stored is None:
        parts = _decompose(vertices, faces, max_parts, resolution)
        stored = np.concatenate(parts), np.array([len(part) for part in parts])
        _write(path, *stored)
    return tuple(np.split(stored[0], np.cumsum(stored[1])[:-1]))


def signed_distance(points: np.ndarray, parts: tuple[np.ndarray, ...]) -> np.ndarray:
    """Return how far points (P, 3) lie outside (positive) or inside (negative) a union of convex parts, (P,).

    The distance to a part is the largest distance beyond one of its face planes: exact inside the part and in front of
        a
    face, a lower bound in front of an edge or corner. For points on a surface, its absolute value is the deviation of
    the parts from that surface.
    """
    nearest = np.full(len(points), np.inf)
    for part in parts:
        planes = ConvexHull(part).equations
        # The hull of a fine, round mesh has a hundred thousand planes: all distances at once would take gigabytes.
        step = max(1, DISTANCES_AT_ONCE // len(planes))
        for start in range(0, len(points), step):
            some = slice(start, start + step)
            np.minimum(nearest[some], (points[some] @ planes[:, :3].T + planes[:, 3]).max(axis=1), out=nearest[some])
    return nearest


def refine(vertices: np.ndarray, faces: np.ndarray, share: float) -> tuple[np.ndarray, np.ndarray]:
    """Subdivide a surface until no edge is longer than this share of the surface's length."""
    import trimesh  # not above: most of this module's users need hulls alone, and it takes long to import

    longest = share * float(np.ptp(vertices, axis=0).max())
    refined = trimesh.remesh.subdivide_to_size(np.array(vertices), np.array(faces, dtype=np.int64), longest)
    return np.asarray(refined[0]), np.asarray(refined[1])


def _single_part(vertices: np.ndarray, faces: np.ndarray, max_parts: int) -> np.ndarray | None:
    """Return the hull (V, 3) of a surface that is almost convex, such as that of a can; `None` for others."""
    hull = ConvexHull(vertices)
    corners = vertices[faces[:: max(1, len(faces) // 2000)].astype(np.int64)]  # 2000 faces are enough
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = np.linalg.norm(np.cross(first, second), axis=1)
    depths = -signed_distance(corners.mean(axis=1), (vertices[hull.vertices],))
    if max_parts > 1 and areas[depths > _CONVEX_WITHIN].sum() > 0.05 * areas.sum():
        return None
    return few_vertices(vertices[hull.vertices], MAX_SINGLE_VERTICES)


def _decompose(vertices: np.ndarray, faces: np.ndarray, max_parts: int, resolution: int) -> tuple[np.ndarray, ...]:
    # V-HACD pulls its voxels toward nearby vertices: on large triangles its error is several centimetres.
    vertices, faces = refine(vertices, faces, 1 / 60)
    raw = vhacdx.compute_vhacd(
        vertices,
        faces.astype(np.uint32),
        maxConvexHulls=max_parts,
        resolution=resolution,
        minimumVolumePercentErrorAllowed=0.5,
        maxNumVerticesPerCH=2 * MAX_PART_VERTICES,
        asyncACD=False,
    )
    parts = []
    for part_vertices, _ in raw:
        # V-HACD cuts off corners when it limits the vertices itself, so twice as many are requested.
        with contextlib.suppress(QhullError):
            hull = ConvexHull(np.asarray(part_vertices))
            if hull.volume > _SMALLEST_PART:
                parts.append(few_vertices(hull.points[hull.vertices]))
    if not parts:
        raise ValueError("the convex decomposition found no part with a volume")
    return tuple(parts)


def few_vertices(vertices: np.ndarray, most: int = MAX_PART_VERTICES) -> np.ndarray:
    """Select at most `most` of a convex body's vertices (V, 3): greedily, the farthest outside the hull so far."""
    if len(vertices) <= most:
        return vertices
    # Extremes along the axes keep bottom, top and width exact; diagonals ensure a volume.
    diagonals = [[1, 1, 1], [1, -1, 1], [-1, 1, 1], [-1, -1, 1]]
    along = vertices @ np.array([*np.eye(3), *diagonals]).T
    chosen = sorted({*along.argmin(axis=0).tolist(), *along.argmax(axis=0).tolist()})
    while len(chosen) < most:
        try:
            planes = ConvexHull(vertices[chosen]).equations
        except QhullError:  # all extremes lie in one plane
            chosen.append(next(index for index in range(len(vertices)) if index not in chosen))
            continue
        outside = (vertices @ planes[:, :3].T + planes[:, 3]).max(axis=1)
        if outside.max() < 1e-6:
            break
        chosen.append(int(outside.argmax()))
    return vertices[chosen]


def _read(path: Path, max_parts: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Read the vertices (N, 3) float64 of all parts and their numbers; `None` for a missing or unusable entry."""
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(member.file_size for member in archive.infolist()) > _LARGEST_ENTRY:
                return None
        with np.load(path, allow_pickle=False) as stored:
            vertices, counts = stored["vertices"], stored["counts"]
    except Exception:  # missing or damaged: readers of broken archives raise almost any exception
        return None
    fits = (
        (vertices.dtype, vertices.ndim, vertices.shape[-1:]) == (np.float64, 2, (3,))
        and (counts.dtype.kind, counts.ndim) == ("i", 1)
        and 1 <= len(counts) <= max_parts
        and all(4 <= count <= MAX_PART_VERTICES for count in counts.tolist())
        and counts.sum() == len(vertices)
        and np.isfinite(vertices).all()
    )
    return (np.ascontiguousarray(vertices), counts) if fits else None


def _write(path: Path, vertices: np.ndarray, counts: np.ndarray) -> None:
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        # Written to a temporary file and moved, so that another process never reads half a file.
        handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".npz")
        try:
            with os.fdopen(handle, "wb") as file:
                np.savez_compressed(file, vertices=vertices, counts=counts)
            os.replace(temporary, path)
        finally:  # a full disk leaves nothing behind
            Path(temporary).unlink(missing_ok=True)
