"""Render the meshes of a table: which surface every ray meets, what two places see of it, and its colours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import open3d
import trimesh

from agent.synthetic_tables.prints import Print, Surface, draw_print
from structdiffusion.geometry import transform_points

TABLE, FLOOR, WALL = 0, -1, -2  # beside the objects' numbers from 1 on
_DARK = 0.1  # share of objects that are dark or shiny
_TEXTURED = 0.5  # share of surfaces with a pattern


@dataclass(frozen=True)
class Part:
    """A mesh of the scene.

    Attributes:
        mesh: at its place.
        number: of its object, or of the room.
        color, accent: (3,) linear RGB of the surface and of its pattern.
        waves: (2, 3) of the pattern, radians per metre.
        dark: whether it is dark or shiny.
        printed: its print, in place of colour and pattern.
        object_from_scene: (4, 4) to the frame of the print.
    """

    mesh: trimesh.Trimesh
    number: int
    color: np.ndarray
    accent: np.ndarray
    waves: np.ndarray
    dark: bool
    printed: Print | None = None
    object_from_scene: np.ndarray | None = None


@dataclass(frozen=True)
class Hits:
    """What the rays (H, W) of a picture meet.

    Attributes:
        there: (H, W) whether a ray meets anything.
        distance: (H, W) in lengths of the rays; infinite where nothing is met.
        own: (H, W) the part of the scene; 0 where nothing is met.
        points, normals: (H, W, 3) scene frame, metres and unit.
    """

    there: np.ndarray
    distance: np.ndarray
    own: np.ndarray
    points: np.ndarray
    normals: np.ndarray


def object_part(mesh: trimesh.Trimesh, pose: np.ndarray, number: int, rng: np.random.Generator) -> Part:
    """Return an object at its pose (4, 4), with a colour; one in ten is dark or shiny."""
    return looks(_at(mesh, pose), number, rng, rng.random() < _DARK)


def printed_part(mesh: trimesh.Trimesh, pose: np.ndarray, number: int, rng: np.random.Generator) -> Part:
    """Return an object at its pose (4, 4) with a print, as most that are bought have; one in ten is shiny."""
    return replace(object_part(mesh, pose, number, rng), printed=draw_print(rng), object_from_scene=np.linalg.inv(pose))


def of_the_same_print(part: Part, mesh: trimesh.Trimesh, pose: np.ndarray, number: int) -> Part:
    """Return another object of the same product, at its pose (4, 4)."""
    return replace(part, mesh=_at(mesh, pose), number=number, object_from_scene=np.linalg.inv(pose))


def _at(mesh: trimesh.Trimesh, pose: np.ndarray) -> trimesh.Trimesh:
    mesh = mesh.copy()
    mesh.apply_transform(pose)
    return mesh


def looks(mesh: trimesh.Trimesh, number: int, rng: np.random.Generator, dark: bool) -> Part:
    """Return a mesh with a colour, and in half of the cases a pattern of a second one."""
    color = rng.uniform(0.02, 0.12, 3) if dark else rng.uniform(0.15, 0.95, 3)
    accent = rng.uniform(0.1, 0.95, 3) if rng.random() < _TEXTURED else color
    return Part(mesh, number, color, accent, rng.uniform(-120.0, 120.0, (2, 3)), dark)


def ray_scene(parts: Sequence[Part]) -> open3d.t.geometry.RaycastingScene:
    """Return the scene of some parts, in their order."""
    scene = open3d.t.geometry.RaycastingScene()
    for part in parts:
        scene.add_triangles(
            open3d.core.Tensor(part.mesh.vertices.astype(np.float32)),
            open3d.core.Tensor(part.mesh.faces.astype(np.uint32)),
        )
    return scene


def camera_pose(eye: np.ndarray, forward: np.ndarray, roll: float) -> np.ndarray:
    """Return the pose (4, 4) of a camera; z forward, x right, y down.

    Args:
        eye: (3,) where it stands, metres.
        forward: (3,) its direction of view, of length 1 and not vertical.
        roll: about that direction, radians.
    """
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    pose = np.eye(4)
    pose[:3, 0] = math.cos(roll) * right + math.sin(roll) * down
    pose[:3, 1] = math.cos(roll) * down - math.sin(roll) * right
    pose[:3, 2], pose[:3, 3] = forward, eye
    return pose


def camera_rays(camera: np.ndarray, focal: float, width: int, height: int) -> np.ndarray:
    """Return rays (H, W, 6) float32: origin, and direction with length 1 along the axis of a camera (4, 4)."""
    columns = (np.arange(width) + 0.5 - width / 2) / focal
    rows = (np.arange(height) + 0.5 - height / 2) / focal
    ahead = np.stack((*np.meshgrid(columns, rows), np.ones((height, width))), axis=-1) @ camera[:3, :3].T
    return np.concatenate((np.broadcast_to(camera[:3, 3], ahead.shape), ahead), axis=-1).astype(np.float32)


def cast(scene: open3d.t.geometry.RaycastingScene, rays: np.ndarray) -> Hits:
    """Return what rays (H, W, 6) meet."""
    hit = scene.cast_rays(open3d.core.Tensor(rays))
    distance, own = hit["t_hit"].numpy(), hit["geometry_ids"].numpy().astype(np.int64)
    there = np.isfinite(distance)
    own[~there] = 0
    points = rays[..., :3] + rays[..., 3:] * np.where(there, distance, 0.0)[..., None]
    return Hits(there, distance, own, points, hit["primitive_normals"].numpy())


def facing(hits: Hits, rays: np.ndarray) -> np.ndarray:
    """Return the cosine (H, W) of the angle between the surfaces' normals and the lines of sight."""
    sight = rays[..., 3:] / np.linalg.norm(rays[..., 3:], axis=-1, keepdims=True)
    return np.abs((hits.normals * sight).sum(axis=-1))


def visible(scene: open3d.t.geometry.RaycastingScene, hits: Hits, place: np.ndarray) -> np.ndarray:
    """Return whether each point (H, W) is seen from a place (3,)."""
    toward = place - hits.points
    side = np.sign((hits.normals * toward).sum(axis=-1, keepdims=True))
    start = hits.points + 5e-4 * side * hits.normals
    rays = np.concatenate((start, place - start), axis=-1).astype(np.float32)
    return ~scene.test_occlusions(open3d.core.Tensor(rays), tnear=0.0, tfar=1.0).numpy()


def colors(
    parts: Sequence[Part], hits: Hits, lamp: np.ndarray, shade: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Return the picture (H, W, 3) uint8 RGB: diffuse surfaces under one lamp and a bright room.

    Args:
        parts, hits: the scene, and what is seen of it.
        lamp: (3,) its place.
        shade: (H, W) what the lamp does not reach.
        rng: of the camera's noise.
    """
    first, second = (np.array([getattr(part, name) for part in parts])[hits.own] for name in ("color", "accent"))
    waves = np.array([part.waves for part in parts])[hits.own]
    pattern = np.sin(np.einsum("hwkc,hwc->hwk", waves, hits.points)).prod(axis=-1) > 0.25
    base = np.where(pattern[..., None], second, first)
    for index, part in enumerate(parts):
        mine = hits.there & (hits.own == index)
        if part.printed is not None and mine.any():
            base[mine] = part.printed.colors(_surface(part, hits, mine))
    toward = lamp - hits.points
    toward /= np.linalg.norm(toward, axis=-1, keepdims=True)
    lit = np.abs((hits.normals * toward).sum(axis=-1)) * ~shade
    bright = base * (0.45 + 0.55 * lit)[..., None] + rng.normal(0.0, 0.012, base.shape)
    return (255 * np.clip(bright, 0.0, 1.0) ** (1 / 2.2)).astype(np.uint8)


def _surface(part: Part, hits: Hits, mine: np.ndarray) -> Surface:
    """Return the pixels (H, W) of a part as points of its surface."""
    assert part.object_from_scene is not None
    turn = part.object_from_scene[:3, :3].T
    points = transform_points(part.object_from_scene, hits.points[mine])
    own = transform_points(part.object_from_scene, part.mesh.vertices)
    return Surface(points, hits.normals[mine] @ turn, own.min(axis=0), own.max(axis=0))
