"""Render single objects on a table as a depth camera measures them: material for learning and judging nouns."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import open3d
import trimesh

from agent.synthetic_tables.sensors import SENSORS, DepthSensor, measured
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.simulation.depth_camera import DepthCamera

_WIDTH, _HEIGHT = 640, 480
_AROUND = 0.3  # of the object's size in the picture, on each side of it
_LEAST = 250  # measured pixels of an object
_DARK = 0.1  # share of objects that are dark or shiny
_HIDDEN = 0.25  # share of objects of which something in front hides a part
_LOST_FOOT = 0.006  # m: up to this height a segmenter takes an object for its table


@dataclass(frozen=True)
class Surface:
    """A mesh with a picture on it.

    Attributes:
        mesh: z up, metres.
        uv: (V, 2) texture coordinates of its vertices, or `None`.
        texture: (H, W, 3) float in [0, 1], or `None` for plain surfaces.
        color: (3,) of a plain surface.
    """

    mesh: trimesh.Trimesh
    uv: np.ndarray | None = None
    texture: np.ndarray | None = None
    color: tuple[float, float, float] = (0.6, 0.6, 0.6)


@dataclass(frozen=True)
class ObjectView:
    """One object as a camera sees it.

    Attributes:
        color: (H, W, 3) uint8 RGB of the part of the picture around it.
        mask: (H, W) bool of its pixels.
        points: (P, 3) that were measured of it, world frame, z up, the table at 0.
        eye: (3,) position of the camera.
    """

    color: np.ndarray
    mask: np.ndarray
    points: np.ndarray
    eye: np.ndarray


def object_view(surfaces: list[Surface], rng: np.random.Generator, picture: bool = True) -> ObjectView | None:
    """Render an object, turned at random about the vertical, from a random place; `None` if too little is seen.

    Args:
        surfaces: its parts; the lowest point is set on the table.
        rng: the only source of randomness.
        picture: render its colours too; otherwise the picture is black.
    """
    turn = pose_from_xyz_yaw(0.0, 0.0, -min(part.mesh.bounds[0, 2] for part in surfaces), rng.uniform(0, 2 * math.pi))
    meshes = [part.mesh.copy().apply_transform(turn) for part in surfaces]
    sensor = SENSORS[int(rng.integers(len(SENSORS)))]
    camera = _camera(sensor, rng)
    rays = _rays(camera, np.concatenate([mesh.vertices for mesh in meshes]))
    table = trimesh.creation.box((3.0, 3.0, 0.02))
    table.apply_translation((0.0, 0.0, -0.01))
    scene = open3d.t.geometry.RaycastingScene()
    for mesh in (table, *meshes):
        scene.add_triangles(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32))
    hit = scene.cast_rays(open3d.core.Tensor(rays))
    distance, own = hit["t_hit"].numpy(), hit["geometry_ids"].numpy().astype(np.int64)
    there = np.isfinite(distance)
    own[~there] = 0
    normals = hit["primitive_normals"].numpy()
    points = rays[..., :3] + rays[..., 3:] * np.where(there, distance, 0.0)[..., None]
    eye = np.array(camera.eye)
    lamp = np.array([*rng.uniform(-1.5, 1.5, 2), rng.uniform(0.8, 2.5)])
    other = eye + sensor.baseline * camera.world_from_camera[:3, 0]
    shadow = there & ~_visible(scene, points, normals, other)
    sight = rays[..., 3:] / np.linalg.norm(rays[..., 3:], axis=-1, keepdims=True)
    cosine = np.abs((normals * sight).sum(axis=-1))
    dark = (own > 0) & (rng.random() < _DARK)
    depth = measured(np.where(there, distance, np.inf), cosine, shadow, dark, sensor, rng)
    color = np.zeros((*own.shape, 3), np.uint8)
    if picture:
        shade = there & ~_visible(scene, points, normals, lamp)
        color = _picture(surfaces, hit, own, points, normals, lamp, shade, rng)
    seen = rays[..., :3] + rays[..., 3:] * depth[..., None]
    seen = seen @ _tilt(rng).T
    seen[..., 2] += rng.normal(0.0, 0.0015)
    mask = (own > 0) & np.isfinite(depth) & (seen[..., 2] > rng.uniform(0.0, _LOST_FOOT))
    if mask.any() and rng.random() < _HIDDEN:
        mask &= ~_hidden(mask, rng)
    if mask.sum() < _LEAST:
        return None
    return ObjectView(color, mask, seen[mask].astype(np.float32), eye)


def _tilt(rng: np.random.Generator) -> np.ndarray:
    """Return a small rotation (3, 3): the error of the table's plane."""
    x, y = rng.normal(0.0, math.radians(0.5), 2)
    return trimesh.transformations.euler_matrix(x, y, 0.0)[:3, :3]


def _camera(sensor: DepthSensor, rng: np.random.Generator) -> DepthCamera:
    distance, rise = rng.uniform(0.55, 1.25), math.radians(rng.uniform(22.0, 65.0))
    target = np.array([*rng.uniform(-0.2, 0.2, 2), 0.04])
    eye = target + distance * np.array([-math.cos(rise), 0.0, math.sin(rise)])
    field = 2 * math.atan(_HEIGHT / 2 / sensor.focal)
    return DepthCamera(tuple(eye.tolist()), tuple(target.tolist()), vertical_field=field)


def _rays(camera: DepthCamera, vertices: np.ndarray) -> np.ndarray:
    """Return the rays (H, W, 6) of the pixels around an object; their directions have length 1 along the axis."""
    pixels = camera.pixels(vertices)
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    margin = _AROUND * float((high - low).max()) + 4
    low, high = np.floor(low - margin).astype(int), np.ceil(high + margin).astype(int)
    columns = (np.arange(low[0], high[0]) + 0.5 - _WIDTH / 2) / camera.focal
    rows = (np.arange(low[1], high[1]) + 0.5 - _HEIGHT / 2) / camera.focal
    pose = camera.world_from_camera
    ahead = np.stack((*np.meshgrid(columns, rows), np.ones((len(rows), len(columns)))), axis=-1) @ pose[:3, :3].T
    return np.concatenate((np.broadcast_to(pose[:3, 3], ahead.shape), ahead), axis=-1).astype(np.float32)


def _visible(
    scene: open3d.t.geometry.RaycastingScene, points: np.ndarray, normals: np.ndarray, place: np.ndarray
) -> np.ndarray:
    """Return whether each point (H, W, 3) is seen from a place (3,)."""
    toward = place - points
    side = np.sign((normals * toward).sum(axis=-1, keepdims=True))
    start = points + 5e-4 * side * normals
    rays = np.concatenate((start, place - start), axis=-1).astype(np.float32)
    return ~scene.test_occlusions(open3d.core.Tensor(rays), tnear=0.0, tfar=1.0).numpy()


def _picture(
    surfaces: list[Surface],
    hit: dict[str, open3d.core.Tensor],
    own: np.ndarray,
    points: np.ndarray,
    normals: np.ndarray,
    lamp: np.ndarray,
    shade: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:
    """Return the picture (H, W, 3) uint8 RGB: diffuse surfaces under one lamp and a bright room."""
    base = np.broadcast_to(rng.uniform(0.1, 0.9, 3), (*own.shape, 3)).copy()
    for number, part in enumerate(surfaces, start=1):
        base[own == number] = _colors(part, hit, own == number)
    toward = lamp - points
    toward /= np.linalg.norm(toward, axis=-1, keepdims=True)
    lit = np.abs((normals * toward).sum(axis=-1)) * ~shade
    room = rng.uniform(0.35, 0.7)
    bright = base * (room + (1.0 - room) * lit)[..., None] * rng.uniform(0.7, 1.15) + rng.normal(0.0, 0.01, base.shape)
    return (255 * np.clip(bright, 0.0, 1.0) ** (1 / 2.2)).astype(np.uint8)


def _colors(part: Surface, hit: dict[str, open3d.core.Tensor], mine: np.ndarray) -> np.ndarray:
    """Return the linear colours (P, 3) of the pixels of one surface."""
    if part.texture is None or part.uv is None:
        return np.broadcast_to(np.asarray(part.color), (int(mine.sum()), 3))
    faces = part.mesh.faces[hit["primitive_ids"].numpy()[mine].astype(np.int64)]
    second, third = hit["primitive_uvs"].numpy()[mine].T
    weights = np.stack((1.0 - second - third, second, third), axis=1)
    uv = (part.uv[faces] * weights[..., None]).sum(axis=1) % 1.0
    height, width = part.texture.shape[:2]
    columns = np.minimum((uv[:, 0] * width).astype(int), width - 1)
    rows = np.minimum(((1.0 - uv[:, 1]) * height).astype(int), height - 1)
    return part.texture[rows, columns] ** 2.2


def _hidden(mask: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the pixels (H, W) beyond a straight line that cuts up to two fifths off the mask."""
    rows, columns = np.nonzero(mask)
    turn = rng.choice((0.0, math.pi, math.pi / 2)) + rng.normal(0.0, 0.3)  # from the left, the right or below
    along = columns * math.cos(turn) + rows * math.sin(turn)
    limit = np.quantile(along, 1.0 - rng.uniform(0.05, 0.4))
    grid = np.indices(mask.shape)
    return grid[1] * math.cos(turn) + grid[0] * math.sin(turn) > limit
