"""Convert a triangle mesh, z up, into an ObjectModel: cleaned, at rest, with its front turned to +x."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import manifold3d
import numpy as np
import trimesh
from scipy.spatial import ConvexHull, QhullError

from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects.decomposition import MAX_PARTS, convex_parts, few_vertices
from structdiffusion.objects.hollow import HOLLOW, hollow_parts
from structdiffusion.objects.model import SURFACE_POINTS, ObjectModel, footprint_centroid
from structdiffusion.objects.rigid_body import mass_properties
from structdiffusion.tableware import CUTLERY

VISUAL_FACES = 2000
# m by which the surface may move to reduce faces, in the order tried; the noise of a depth camera is a millimetre.
_COARSER_BY = (0.00002, 0.00005, 0.0001, 0.0002)
# The front of these is opposite their handle.
WITH_HANDLE = ("mug", "pan", "skillet", "pitcher", "jug", "teapot", "kettle", "saucepan")
# These lie along x, working end toward +x.
LONG = (
    *CUTLERY, "spatula", "ladle", "screwdriver", "hammer", "wrench", "scissors", "clamp", "drill",
    "marker", "pen", "pencil", "brush", "banana", "pear", "car", "airplane",
)  # fmt: skip
# rad: an approximately upright scan or model comes to rest within this angle.
UPRIGHT_WITHIN = math.radians(20.0)


def clean(mesh: trimesh.Trimesh) -> list[trimesh.Trimesh]:
    """Return the connected pieces of a mesh, with vertices merged, without degenerate faces and specks, normals
    outward.

    Specks are loose pieces with less than 2 % of the surface, which are artefacts of scanning.
    """
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)
    mesh.update_faces(mesh.nondegenerate_faces() & mesh.unique_faces())
    mesh.remove_unreferenced_vertices()
    # Separated before any piece is built: a file can have a hundred thousand specks.
    connected = trimesh.graph.connected_components(
        mesh.face_adjacency, nodes=np.arange(len(mesh.faces)), min_len=1, engine="scipy"
    )
    areas, least = mesh.area_faces, 0.02 * mesh.area
    kept = [faces for faces in connected if areas[faces].sum() > least]
    found: Any = mesh.submesh(kept, only_watertight=False) if kept else []
    pieces = list(found)
    for piece in pieces:
        piece.fix_normals()
    return pieces


def join(pieces: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    """Unite closed pieces that overlap into one outer surface, so that no surface remains inside."""
    if len(pieces) == 1:
        return pieces[0]
    solids = [_solid(piece) for piece in pieces]
    if any(solid.status() != manifold3d.Error.NoError for solid in solids):
        joined = trimesh.util.concatenate(pieces)
        assert isinstance(joined, trimesh.Trimesh)
        return joined
    united = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add).to_mesh()
    return trimesh.Trimesh(united.vert_properties[:, :3], united.tri_verts, process=True)


def _solid(mesh: trimesh.Trimesh) -> manifold3d.Manifold:
    return manifold3d.Manifold(
        manifold3d.Mesh(np.asarray(mesh.vertices, dtype=np.float32), np.asarray(mesh.faces, dtype=np.uint32))
    )


def level(parts: tuple[np.ndarray, ...], within: float = UPRIGHT_WITHIN) -> np.ndarray:
    """Return the smallest rotation (4, 4) that sets convex parts on the face of their hull onto which they settle.

    The parts roll from face to face as long as the centre of mass sinks. The result is the identity if they would turn
    by more than `within` radians: then the cause is not an uneven bottom.
    """
    hull = ConvexHull(np.concatenate(parts))
    center = mass_properties(parts, 1.0).object_from_inertial[:3, 3]
    normals, heights = hull.equations[:, :3], -(hull.equations[:, :3] @ center + hull.equations[:, 3])
    down, face = np.array([0.0, 0.0, -1.0]), -1
    while True:
        # The face through which the vertical below the centre of mass leaves the hull.
        towards = normals @ down
        reach = np.where(towards > 1e-9, heights / np.maximum(towards, 1e-9), math.inf)
        below = int(reach.argmin())
        if below == face or (face >= 0 and heights[below] >= heights[face] - 1e-12):
            break
        down, face = normals[below], below
    tilt = math.acos(np.clip(-down[2], -1.0, 1.0))
    if not 1e-6 < tilt < within:
        return np.eye(4)
    return trimesh.transformations.rotation_matrix(tilt, np.cross(down, [0.0, 0.0, -1.0]))


def front_yaw(points: np.ndarray, category: str) -> float:
    """Return the yaw, radians, of the front of an object with surface points (P, 3), z up.

    - objects with a handle (mug, pan, pitcher): opposite the handle, the part farthest from the middle of the surface;
    - long objects: along the length; cutlery and spatulas toward the flatter, wider end;
    - all others: perpendicular to the longest side of the smallest rectangle around the footprint, so that the front of
      a box is its broad face.
    """
    flat = points[:, :2]
    middle = flat.mean(axis=0)
    offset = flat - middle
    if category in WITH_HANDLE:
        distance = np.linalg.norm(offset, axis=1)
        handle = offset[distance > 0.93 * distance.max()].mean(axis=0)
        return math.atan2(-handle[1], -handle[0])
    if category in LONG:
        _, axes = np.linalg.eigh(offset.T @ offset)
        direction = axes[:, 1]
        if _flatness(points, -direction) > _flatness(points, direction):
            direction = -direction
        return math.atan2(direction[1], direction[0])
    outline = flat[ConvexHull(flat).vertices]
    edges = np.roll(outline, -1, axis=0) - outline
    best_area, best = math.inf, 0.0
    for angle in np.arctan2(edges[:, 1], edges[:, 0]):
        c, s = math.cos(angle), math.sin(angle)
        along, across = outline @ [c, s], outline @ [-s, c]
        length, width = np.ptp(along), np.ptp(across)
        if length * width < best_area * (1 - 1e-6):
            best_area, best = length * width, float(angle if length < width else angle + math.pi / 2)
    # The rectangle has two such yaws: choose the one that turns the scan less.
    return (best + math.pi / 2) % math.pi - math.pi / 2


def _flatness(points: np.ndarray, direction: np.ndarray) -> float:
    """Return width over thickness of the third of an object that lies farthest along `direction` (2,)."""
    along = points[:, :2] @ direction
    end = points[along > along.max() - 0.3 * np.ptp(along)]
    across = end[:, :2] @ np.array([-direction[1], direction[0]])
    # Thickness about the curved middle surface: a spoon's bowl is deep, but its metal is thin.
    terms = np.stack([np.ones(len(end)), across, end[:, :2] @ direction], axis=1)
    terms = np.concatenate([terms, terms[:, 1:] ** 2], axis=1)
    fit, *_ = np.linalg.lstsq(terms, end[:, 2], rcond=None)
    return float(across.std() / ((end[:, 2] - terms @ fit).std() + 1e-6))


def sample_surface(mesh: trimesh.Trimesh, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Sample points and outward normals (count, 3) float32, uniform by area; the same for the same seed."""
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(mesh.faces), size=count, p=mesh.area_faces / mesh.area_faces.sum())
    a, b = rng.random((2, count, 1))
    folded = a + b > 1
    a, b = np.where(folded, 1 - a, a), np.where(folded, 1 - b, b)
    corners = mesh.triangles[chosen]
    points = corners[:, 0] + a * (corners[:, 1] - corners[:, 0]) + b * (corners[:, 2] - corners[:, 0])
    return points.astype(np.float32), mesh.face_normals[chosen].astype(np.float32)


def simplify(mesh: trimesh.Trimesh, faces: int = VISUAL_FACES) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices (V, 3) and faces (F, 3) of a coarser surface for pictures, within 2 mm of the mesh.

    It has about `faces` faces if the 2 mm allow it. A mesh that is not closed is returned unchanged.
    """
    best = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    solid = _solid(mesh)
    if solid.status() != manifold3d.Error.NoError:
        return best
    for tolerance in (0.0003, 0.0005, 0.001, 0.0015, 0.002):
        if len(best[1]) <= faces:
            break
        coarse = solid.simplify(tolerance).to_mesh()
        if 0 < len(coarse.tri_verts) < len(best[1]):
            best = coarse.vert_properties[:, :3].astype(np.float64), coarse.tri_verts.astype(np.int64)
    return best


def coarser(mesh: trimesh.Trimesh, most: int) -> trimesh.Trimesh:
    """Reduce a surface to about `most` faces; a mesh that has no more is returned unchanged.

    The surface of a closed mesh moves by at most 0.2 mm. A mesh with holes, and one that still has too many faces, is
    decimated to `most` faces by the quadric error of its planes (Garland and Heckbert 1997).
    """
    if len(mesh.faces) <= most:
        return mesh
    # merges vertices, which a triangle soup does not share
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)
    solid = _solid(mesh)
    if solid.status() == manifold3d.Error.NoError:
        for tolerance in _COARSER_BY:
            fewer = solid.simplify(tolerance).to_mesh()
            if 0 < len(fewer.tri_verts) <= most:
                return trimesh.Trimesh(fewer.vert_properties[:, :3], fewer.tri_verts, process=False)
    import open3d

    fine = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(mesh.vertices), open3d.utility.Vector3iVector(mesh.faces)
    )
    decimated = fine.simplify_quadric_decimation(most)
    return trimesh.Trimesh(np.asarray(decimated.vertices), np.asarray(decimated.triangles), process=False)


@dataclass(frozen=True)
class ObjectProperties:
    """What an object's mesh does not tell of it.

    Attributes:
        name, category, source, mass, friction, color: as of an `ObjectModel`; mass in kilograms.
    """

    name: str
    category: str
    source: str
    mass: float
    friction: float
    color: tuple[float, float, float]


def object_from_mesh(
    mesh: trimesh.Trimesh,
    properties: ObjectProperties,
    *,
    turn: float = 0.0,
    settle_within: float = UPRIGHT_WITHIN,
    max_parts: int = MAX_PARTS,
) -> ObjectModel:
    """Build an ObjectModel of an approximately upright mesh in metres (z up).

    Args:
        mesh: the surface; cleaned here.
        properties: what the mesh does not tell.
        turn: radians added to the result of `front_yaw`, for objects that look alike from both ends.
        settle_within: how far, in radians, it may roll over to rest.
        max_parts: the largest number of convex parts.

    Raises:
        ValueError: if the mesh encloses no volume.
    """
    pieces = clean(mesh)
    if not pieces:
        raise ValueError("it has no surface")
    mesh = join(pieces)
    if len(pieces) > 1 and all(piece.volume > 0.99 * piece.convex_hull.volume for piece in pieces):
        parts = tuple(few_vertices(np.asarray(piece.convex_hull.vertices)) for piece in pieces)
    else:
        parts = _vessel_parts(mesh) if properties.category in HOLLOW else ()
        parts = parts or convex_parts(mesh.vertices, mesh.faces, max_parts=max_parts)
    upright = level(parts, settle_within)
    dense, _ = sample_surface(mesh, 20_000, seed=0)
    yaw = front_yaw(transform_points(upright, dense), properties.category) + turn
    upright = pose_from_xyz_yaw(0.0, 0.0, 0.0, -yaw) @ upright
    mesh.apply_transform(upright)
    parts = tuple(transform_points(upright, part) for part in parts)
    floor = _flatten_bottom(parts)
    origin = np.array([*footprint_centroid(np.concatenate(parts)[:, :2]), floor])
    mesh.apply_translation(-origin)
    points, normals = sample_surface(mesh, SURFACE_POINTS, seed=0)
    vertices, faces = simplify(mesh)
    return ObjectModel(
        name=properties.name,
        category=properties.category,
        source=properties.source,
        hulls=tuple(part - origin for part in parts),
        surface_points=points,
        surface_normals=normals,
        mass=properties.mass,
        friction=properties.friction,
        color=properties.color,
        mesh_vertices=vertices,
        mesh_faces=faces,
    )


def _flatten_bottom(parts: Sequence[np.ndarray]) -> float:
    """Make the bottom of parts (V, 3) level, in place; return its z.

    Voxels leave bottoms uneven by a fraction of a millimetre, so that objects would rock.
    """
    floor = min(part[:, 2].min() for part in parts)
    for part in parts:
        if part[:, 2].max() > floor + 0.0015:  # a thinner part would become a sheet
            part[part[:, 2] < floor + 0.001, 2] = floor
    return floor


def _vessel_parts(mesh: trimesh.Trimesh) -> tuple[np.ndarray, ...]:
    """Return `hollow_parts`, or () if the mesh is so unlike a vessel that the geometry fails, such as a cone."""
    try:
        return hollow_parts(mesh)
    except (QhullError, ValueError):
        return ()
