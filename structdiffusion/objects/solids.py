"""Build objects from convex parts: the parts define both the surface and the collision body."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial import ConvexHull

from structdiffusion.objects.model import SURFACE_POINTS, ObjectModel, footprint_centroid

# m: a surface point is inside, and dropped, if a step of this length along its normal ends in another part.
_INNER_STEP = 1e-4


def prism(outline: np.ndarray, z_low: float, z_high: float, top_scale: float = 1.0) -> np.ndarray:
    """Return vertices (2K, 3) of a prism over a convex outline (K, 2), metres; the top may be scaled."""
    low = np.column_stack((outline, np.full(len(outline), z_low)))
    high = np.column_stack((outline * top_scale, np.full(len(outline), z_high)))
    return np.concatenate((low, high))


def box(length: float, width: float, z_low: float, z_high: float, x: float = 0.0, y: float = 0.0) -> np.ndarray:
    """Return vertices (8, 3) of an axis-aligned box whose middle is at (x, y), metres."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (length / 2, width / 2)
    return prism(corners + (x, y), z_low, z_high)


def circle_outline(radius: float, sides: int = 24, phase: float = 0.0) -> np.ndarray:
    """Return a regular polygon (sides, 2) of the given corner radius, metres."""
    angles = phase + np.arange(sides) * 2 * math.pi / sides
    return radius * np.column_stack((np.cos(angles), np.sin(angles)))


def frustum(r_low: float, r_high: float, z_low: float, z_high: float, sides: int = 24) -> np.ndarray:
    """Return vertices (2 * sides, 3) of a truncated cone about the z axis, metres."""
    return prism(circle_outline(r_low, sides), z_low, z_high, r_high / r_low)


def shell(profile: Sequence[tuple[float, float]], thickness: float, sides: int = 14) -> list[np.ndarray]:
    """Return convex wall pieces, each (8, 3), of a vessel of revolution about the z axis.

    Args:
        profile: outer (radius, z) from the bottom up, metres.
        thickness: of the wall, metres.
        sides: pieces around.
    """
    angles = np.arange(sides + 1) * 2 * math.pi / sides
    pieces = []
    for (r_low, z_low), (r_high, z_high) in zip(profile, profile[1:]):
        for start, end in zip(angles, angles[1:]):
            pieces.append(
                np.array(
                    [
                        (r * math.cos(a), r * math.sin(a), z)
                        for a in (start, end)
                        for outer, z in ((r_low, z_low), (r_high, z_high))
                        for r in (outer, max(outer - thickness, 1e-4))
                    ]
                )
            )
    return pieces


def sample_surface(hulls: Sequence[np.ndarray], count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Sample points and outward normals, both (count, 3) float32, uniformly on the outer surface of a
    union of hulls.
    """
    solids = [ConvexHull(hull) for hull in hulls]
    triangles = np.concatenate([hull[solid.simplices] for hull, solid in zip(hulls, solids)])  # (T, 3, 3)
    normals = np.concatenate([solid.equations[:, :3] for solid in solids])  # (T, 3)
    owner = np.repeat(np.arange(len(solids)), [len(solid.simplices) for solid in solids])
    edges = triangles[:, 1:] - triangles[:, :1]
    area = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)

    points, kept_normals, found = [], [], 0
    while found < count:
        pick = rng.choice(len(area), size=3 * count, p=area / area.sum())
        u, v = rng.random((2, len(pick), 1))
        flip = u + v > 1  # fold the parallelogram onto the triangle
        u, v = np.where(flip, 1 - u, u), np.where(flip, 1 - v, v)
        candidates = triangles[pick, 0] + u * edges[pick, 0] + v * edges[pick, 1]
        probes = candidates + _INNER_STEP * normals[pick]
        outer = np.ones(len(pick), dtype=bool)
        for index, (hull, solid) in enumerate(zip(hulls, solids)):
            near = (owner[pick] != index) & ((probes > hull.min(axis=0)) & (probes < hull.max(axis=0))).all(axis=1)
            inside = (probes[near] @ solid.equations[:, :3].T + solid.equations[:, 3]).max(axis=1) < 0
            outer[np.flatnonzero(near)[inside]] = False
        points.append(candidates[outer])
        kept_normals.append(normals[pick][outer])
        found += int(outer.sum())
    return (
        np.concatenate(points)[:count].astype(np.float32),
        np.concatenate(kept_normals)[:count].astype(np.float32),
    )


def assemble(
    name: str,
    category: str,
    hulls: Sequence[np.ndarray],
    *,
    density: float,
    friction: float,
    color: tuple[float, float, float],
    source: str,
    rng: np.random.Generator,
) -> ObjectModel:
    """Build an `ObjectModel` of convex parts, moved so that its footprint centroid and lowest point are the origin.

    Args:
        density: kilograms per cubic metre of the parts; the mass is limited to 20 g to 1.5 kg.
    """
    points = np.concatenate(hulls)
    origin = np.append(footprint_centroid(points[:, :2]), points[:, 2].min())
    hulls = tuple(hull - origin for hull in hulls)
    solids = [ConvexHull(hull) for hull in hulls]
    offsets = np.cumsum([0] + [len(hull) for hull in hulls[:-1]])
    surface_points, surface_normals = sample_surface(hulls, SURFACE_POINTS, rng)
    return ObjectModel(
        name=name,
        category=category,
        source=source,
        hulls=hulls,
        surface_points=surface_points,
        surface_normals=surface_normals,
        mass=float(np.clip(density * sum(solid.volume for solid in solids), 0.02, 1.5)),
        friction=friction,
        color=color,
        mesh_vertices=np.concatenate(hulls),
        mesh_faces=np.concatenate([_outward(solid) + offset for solid, offset in zip(solids, offsets)]),
    )


def _outward(solid: ConvexHull) -> np.ndarray:
    """Return the hull's triangles (F, 3), wound so that their normals point outward."""
    corners = solid.points[solid.simplices]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = (normal * solid.equations[:, :3]).sum(axis=1) < 0
    faces = solid.simplices.copy()
    faces[inward] = faces[inward][:, ::-1]
    return faces
