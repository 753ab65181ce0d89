"""Cut round objects that are open at the top into convex parts: bowls, plates, cups and mugs.

V-HACD with a few dozen parts makes the walls of a scanned cup 5 to 8 mm too thick, so that spoons and fingers no longer
fit inside. Cutting it like a cake instead (a base, and a ring of wall pieces) follows the wall within about 2 mm with
the same number of parts.
"""

from __future__ import annotations

import math
from itertools import combinations, pairwise

import numpy as np
import trimesh
from scipy.spatial import ConvexHull, QhullError

from structdiffusion.objects.decomposition import few_vertices, refine, signed_distance

HOLLOW = ("bowl", "plate", "cup", "mug", "glass", "saucer")
# m: anything that sticks out of the round body by more than this is a handle.
_HANDLE_FROM = 0.004
# m from the handle's outermost point, at which the wall between the handle's two ends is cut.
_GRIP_DEPTH = 0.012
# m by which the chords of wall pieces may deviate from the round wall.
_CHORD_WITHIN = 0.0016
_IN_FRONT = 0.003  # m in front of a surface that hulls must not reach
# An inner surface belongs to the floor by the upward component of its normal and its share of the rim's radius.
_LEVEL, _FLOOR_WITHIN = 0.5, 0.9
_FRAGMENT = 0.05  # share of the wall's area: smaller pieces are bumps of the floor


def hollow_parts(mesh: trimesh.Trimesh) -> tuple[np.ndarray, ...]:
    """Return convex parts (V, 3), V <= 32, of a round, upright mesh that opens upward, z up; metres.

    The parts are a base below the inner floor, wall pieces around it in two or three rings, and three pieces for a
    handle. The result is () if the mesh is not round or has no inner floor.
    """
    top = mesh.bounds[1, 2]
    rim = mesh.vertices[mesh.vertices[:, 2] > top - 0.001 - 0.025 * mesh.extents[2]][:, :2]
    center, radius, deviation = _fit_circle(rim)
    if deviation > 0.05 * radius:
        return ()
    mesh = trimesh.Trimesh(*refine(mesh.vertices, mesh.faces, 1 / 25), process=True)
    mesh.apply_translation([-center[0], -center[1], 0.0])
    parts: list[np.ndarray] = []
    away = mesh.vertices[np.linalg.norm(mesh.vertices[:, :2], axis=1) > radius + _HANDLE_FROM][:, :2]
    toward = np.zeros(3)
    if len(away):
        toward[:2] = (away / np.linalg.norm(away, axis=1, keepdims=True)).mean(axis=0)
    # A bulge sticks out on all sides, so its mean direction is short; a handle sticks out on one side.
    if np.linalg.norm(toward) > 0.8:
        toward /= np.linalg.norm(toward)
        handle, mesh = _cut(mesh, toward, toward * (radius + 0.0005))
        parts += _handle_parts(handle, toward)
    middle = np.linalg.norm(mesh.triangles_center[:, :2], axis=1) < 0.4 * radius
    floor_faces = middle & (mesh.face_normals[:, 2] > 0.8)
    if not floor_faces.any():
        return ()
    floor = float(np.average(mesh.triangles_center[floor_faces, 2], weights=mesh.area_faces[floor_faces]))
    if top - floor < 0.008:
        return ()
    wall, base = _cut(mesh, np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, floor]))
    parts += _hulls([base])
    inner = np.linalg.norm(wall.vertices[:, :2], axis=1)
    if np.percentile(inner, 1) < 0.3 * radius:  # scan artefacts on the floor would turn wall pieces into wedges
        wall = trimesh.Trimesh(wall.vertices, wall.faces[(inner[wall.faces] > 0.3 * radius).all(axis=1)])
    # A chord over the angle a lies r (1 - cos(a / 2)) inside the circle.
    sectors = math.ceil(math.pi / math.acos(1 - min(0.03, _CHORD_WITHIN / radius)))
    edges = np.linspace(0.0, 2 * math.pi, sectors + 1)
    middles = [(low + high) / 2 for low, high in pairwise(edges)]
    best: tuple[float, list[np.ndarray]] = (math.inf, [])
    for surface in (wall, _without_floor(wall, radius)):
        wedges = [_wedge(surface, low, high) for low, high in pairwise(edges)]
        slope, offsets, error = _best_cuts(wedges, middles)
        if error < best[0]:
            cut = [_hulls(_bands(wedge, angle, slope, offsets)) for wedge, angle in zip(wedges, middles, strict=True)]
            best = error, [hull for hulls in cut for hull in hulls]
    parts += best[1]
    return tuple(part + [center[0], center[1], 0.0] for part in parts)


def _fit_circle(points: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Fit a circle to the outline of points (P, 2); return its centre (2,), its radius,
    and the deviation from round.
    """
    outline = points[ConvexHull(points).vertices]
    terms = np.column_stack([2 * outline, np.ones(len(outline))])
    x, y, constant = np.linalg.lstsq(terms, (outline**2).sum(axis=1), rcond=None)[0]
    radius = math.sqrt(constant + x * x + y * y)
    error = np.abs(np.linalg.norm(outline - [x, y], axis=1) - radius)
    return np.array([x, y]), radius, float(np.percentile(error, 90))


def _cut(mesh: trimesh.Trimesh, normal: np.ndarray, point: np.ndarray) -> tuple[trimesh.Trimesh, trimesh.Trimesh]:
    """Cut a surface by a plane; return the surfaces in front of and behind it."""
    front = trimesh.intersections.slice_mesh_plane(mesh, normal, point)
    return front, trimesh.intersections.slice_mesh_plane(mesh, -normal, point)


def _wedge(wall: trimesh.Trimesh, low: float, high: float) -> trimesh.Trimesh:
    """Return the part of the wall between two angles about z."""
    inside = trimesh.intersections.slice_mesh_plane(wall, [-math.sin(low), math.cos(low), 0], [0, 0, 0])
    return trimesh.intersections.slice_mesh_plane(inside, [math.sin(high), -math.cos(high), 0], [0, 0, 0])


def _hulls(pieces: tuple[trimesh.Trimesh, ...] | list[trimesh.Trimesh]) -> list[np.ndarray]:
    """Return the convex hull's vertices of each piece of surface that spans a volume."""
    hulls = []
    for piece in pieces:
        vertices = np.asarray(piece.vertices)
        if len(vertices) < 4:
            continue
        try:
            hull = ConvexHull(vertices)
        except QhullError:  # a flat sliver at the edge of a cut
            continue
        if hull.volume > 1e-10:
            hulls.append(few_vertices(vertices[hull.vertices]))
    return hulls


def _handle_parts(handle: trimesh.Trimesh, toward: np.ndarray) -> list[np.ndarray]:
    """Return the grip, and the arms above and below the hole."""
    reach = float((handle.vertices @ toward).max())
    grip, arms = _cut(handle, toward, toward * (reach - _GRIP_DEPTH))
    middle = float((grip.bounds[0, 2] + grip.bounds[1, 2]) / 2)
    upper, lower = _cut(arms, np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, middle]))
    return _hulls([grip, upper, lower])


def _across(slope: float, angle: float) -> np.ndarray:
    """Return the unit normal (3,) of a cut through the wall piece at `angle`; slope 0 is level, pi / 2 upright."""
    return np.array([math.sin(slope) * math.cos(angle), math.sin(slope) * math.sin(angle), math.cos(slope)])


def _bands(wedge: trimesh.Trimesh, angle: float, slope: float, offsets: tuple[float, ...]) -> list[trimesh.Trimesh]:
    """Cut a wall piece by parallel planes at rising offsets (metres along their normal)."""
    normal, bands = _across(slope, angle), []
    for offset in offsets:
        wedge, band = _cut(wedge, normal, normal * offset)
        bands.append(band)
    return [*bands, wedge]


def _without_floor(wall: trimesh.Trimesh, radius: float) -> trimesh.Trimesh:
    """Remove remains of an uneven floor from the wall: a piece that includes them would fill the
    vessel up to the rim.
    """
    level = wall.face_normals[:, 2] > _LEVEL
    within = np.linalg.norm(wall.triangles_center[:, :2], axis=1) < _FLOOR_WITHIN * radius
    wall = trimesh.Trimesh(wall.vertices, wall.faces[~(level & within)])
    pieces = trimesh.graph.connected_components(wall.face_adjacency, nodes=np.arange(len(wall.faces)))
    large = [piece for piece in pieces if wall.area_faces[piece].sum() > _FRAGMENT * wall.area]
    return trimesh.Trimesh(wall.vertices, wall.faces[np.concatenate(large)]) if large else wall


def _best_cuts(wedges: list[trimesh.Trimesh], middles: list[float]) -> tuple[float, tuple[float, ...], float]:
    """Find the slope and one or two offsets of the cuts whose hulls follow the surface best, and their error.

    The criterion is the mean over every fourth wall piece of the error that 3 % of its surface exceeds.
    """
    samples = list(zip(wedges, middles, strict=True))[::4]
    best: tuple[float, tuple[float, ...]] = (0.0, ())
    least = math.inf
    for count, slopes in ((1, (0.0, math.pi / 4, math.pi / 2)), (2, None)):
        for slope in slopes or (best[0],):  # a second cut is parallel to the best single one
            spans = [wedge.vertices @ _across(slope, angle) for wedge, angle in samples]
            low, high = min(span.min() for span in spans), max(span.max() for span in spans)
            heights = low + (high - low) * np.array([0.15, 0.3, 0.45, 0.6, 0.75, 0.9])
            for offsets in combinations(heights.tolist(), count):
                errors = []
                for wedge, angle in samples:
                    hulls = tuple(_hulls(_bands(wedge, angle, slope, offsets)))
                    errors.append(np.percentile(_errors(wedge, hulls), 97))
                if np.mean(errors) < least:
                    best, least = (slope, offsets), float(np.mean(errors))
        if least < _CHORD_WITHIN:
            break
    slope, offsets = best
    return slope, offsets, least


def _errors(surface: trimesh.Trimesh, hulls: tuple[np.ndarray, ...]) -> np.ndarray:
    """Return how far (F,), metres, the faces of a surface lie inside the hulls,
    or the hulls extend in front of them.
    """
    inside = -signed_distance(surface.triangles_center, hulls)
    filled = -signed_distance(surface.triangles_center + _IN_FRONT * surface.face_normals, hulls)
    return np.maximum(inside, np.where(filled > 0, filled + _IN_FRONT, 0.0))
