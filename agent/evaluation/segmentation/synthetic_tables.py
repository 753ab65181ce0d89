"""Draw and render synthetic tables with true labels: objects on a table, above a floor and often before a wall."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import open3d
import trimesh

from agent.evaluation.segmentation.arrangements import ARRANGEMENTS, Arrangement, NoRoom, Placed
from agent.evaluation.segmentation.labelled_clouds import LabelledCloud
from agent.evaluation.segmentation.sensors import SENSORS, DepthSensor, measured
from agent.evaluation.segmentation.shapes import PARTS
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points

_WIDTH, _HEIGHT = 640, 480
_DRAWS = 200
_LEAST = 400  # measured pixels of every object
_THICK = 0.03  # m of the table's board
_DARK = 0.1  # share of objects that are dark or shiny
_TEXTURED = 0.5  # share of surfaces with a pattern
_FLOOR, _WALL = -1, -2  # beside the objects' numbers
_TABLE = 0


@dataclass(frozen=True)
class _Part:
    """A mesh of the scene: its number, colour, pattern, and whether it is dark or shiny."""

    mesh: trimesh.Trimesh
    number: int
    color: np.ndarray
    accent: np.ndarray
    waves: np.ndarray
    dark: bool


def synthetic_table(kind: str, part: str, seed: int, number: int) -> LabelledCloud:
    """Draw a table and what a depth camera sees of it.

    Args:
        kind: of arrangement, a key of `ARRANGEMENTS`.
        part: "development" or "test": which objects there are.
        seed, number: the same two give the same table.
    """
    for draw in range(_DRAWS):
        rng = np.random.default_rng((seed, list(PARTS).index(part), list(ARRANGEMENTS).index(kind), number, draw))
        half = np.array([rng.uniform(0.32, 0.5), rng.uniform(0.35, 0.7)])
        scene = Arrangement(PARTS[part], half, rng)
        try:
            ARRANGEMENTS[kind](scene)
        except NoRoom:
            continue
        cloud = _seen(scene, half, kind, f"{kind} {number}", rng)
        if cloud is not None:
            return cloud
    raise RuntimeError(f"no table of the kind {kind!r} could be drawn in {_DRAWS} attempts")


def _seen(
    arranged: Arrangement, half: np.ndarray, kind: str, name: str, rng: np.random.Generator
) -> LabelledCloud | None:
    """Render a scene; `None` if too little of an object is seen, or one is cut by the picture's border."""
    sensor = SENSORS[int(rng.integers(len(SENSORS)))]
    camera = _camera(rng)
    placed = arranged.placed
    parts = _surroundings(half, rng, arranged.at_wall)
    parts += [_part(one, index + 1, rng) for index, one in enumerate(placed)]
    scene = open3d.t.geometry.RaycastingScene()
    for part in parts:
        scene.add_triangles(
            open3d.core.Tensor(part.mesh.vertices.astype(np.float32)),
            open3d.core.Tensor(part.mesh.faces.astype(np.uint32)),
        )
    rays = _rays(camera, sensor)
    hit = scene.cast_rays(open3d.core.Tensor(rays))
    distance, own = hit["t_hit"].numpy(), hit["geometry_ids"].numpy().astype(np.int64)
    there = np.isfinite(distance)
    own[~there] = 0
    normals = hit["primitive_normals"].numpy()
    points = rays[..., :3] + rays[..., 3:] * np.where(there, distance, 0.0)[..., None]
    truth = np.where(there, np.array([part.number for part in parts])[own], _FLOOR)
    border = np.concatenate((truth[0], truth[-1], truth[:, 0], truth[:, -1]))
    if _seen_least(truth, len(placed)) < 1.5 * _LEAST or border.max() > _TABLE:
        return None
    eye = transform_points(camera, np.array([[sensor.baseline, 0.0, 0.0]]))[0]
    lamp = np.array([*rng.uniform(-1.5, 1.5, 2), rng.uniform(1.2, 2.5)])
    shadow, shade = (there & ~_visible(scene, points, normals, place) for place in (eye, lamp))
    # Rays are not normalised: their length is the depth along the camera's axis.
    sight = rays[..., 3:] / np.linalg.norm(rays[..., 3:], axis=-1, keepdims=True)
    cosine = np.abs((normals * sight).sum(axis=-1))
    dark = np.array([part.dark for part in parts])[own]
    depth = measured(np.where(there, distance, np.inf), cosine, shadow, dark, sensor, rng)
    truth = np.where(np.isfinite(depth), truth, _FLOOR)
    if _seen_least(truth, len(placed)) < _LEAST:
        return None
    color = _colors(parts, own, points, normals, lamp, shade, rng)
    inverse = np.linalg.inv(camera)
    measured_points = (rays[..., 3:] @ inverse[:3, :3].T) * depth[..., None]
    return LabelledCloud(name, kind, measured_points.astype(np.float32), color, np.maximum(truth, 0), sensor.name)


def _seen_least(truth: np.ndarray, count: int) -> int:
    """Return the number of pixels of the object that is seen least."""
    return int(np.bincount(truth[truth > 0], minlength=count + 1)[1:].min(initial=truth.size))


def _camera(rng: np.random.Generator) -> np.ndarray:
    """Return the pose (4, 4) of a camera that looks at the table, from any side of it; z forward, x right, y down."""
    distance, rise = rng.uniform(0.75, 1.2), math.radians(rng.uniform(28.0, 62.0))
    turn, roll = rng.uniform(-0.7, 0.7), math.radians(rng.normal(0.0, 3.0))
    target = np.array([*rng.uniform(-0.03, 0.03, 2), 0.03])
    eye = target + distance * np.array(
        [-math.cos(rise) * math.cos(turn), -math.cos(rise) * math.sin(turn), math.sin(rise)]
    )
    forward = (target - eye) / distance
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    pose = np.eye(4)
    pose[:3, 0] = math.cos(roll) * right + math.sin(roll) * down
    pose[:3, 1] = math.cos(roll) * down - math.sin(roll) * right
    pose[:3, 2], pose[:3, 3] = forward, eye
    return pose


def _rays(camera: np.ndarray, sensor: DepthSensor) -> np.ndarray:
    """Return rays (H, W, 6) float32: origin, and direction with length 1 along the camera's axis."""
    columns = (np.arange(_WIDTH) + 0.5 - _WIDTH / 2) / sensor.focal
    rows = (np.arange(_HEIGHT) + 0.5 - _HEIGHT / 2) / sensor.focal
    ahead = np.stack((*np.meshgrid(columns, rows), np.ones((_HEIGHT, _WIDTH))), axis=-1) @ camera[:3, :3].T
    return np.concatenate((np.broadcast_to(camera[:3, 3], ahead.shape), ahead), axis=-1).astype(np.float32)


def _surroundings(half: np.ndarray, rng: np.random.Generator, at_wall: bool) -> list[_Part]:
    """Return the table, the floor, and in two of three scenes a wall; always one where the table stands at it."""
    table = trimesh.creation.box((2 * half[0], 2 * half[1], _THICK))
    table.apply_translation((0.0, 0.0, -_THICK / 2))
    floor = trimesh.creation.box((8.0, 8.0, 0.01))
    floor.apply_translation((1.5, 0.0, -rng.uniform(0.45, 0.8)))
    parts = [_looks(table, _TABLE, rng, False), _looks(floor, _FLOOR, rng, False)]
    if at_wall or rng.random() < 0.67:
        wall = trimesh.creation.box((0.02, 8.0, 4.0))
        turn = rng.uniform(-0.3, 0.3)
        # As near as it may stand without cutting through a corner of the table.
        behind = half[0] * math.cos(turn) + half[1] * abs(math.sin(turn)) + 0.01
        wall.apply_translation((behind + rng.uniform(0.01, 0.03 if at_wall else 0.6), 0.0, 0.5))
        wall.apply_transform(pose_from_xyz_yaw(0.0, 0.0, 0.0, turn))
        parts.append(_looks(wall, _WALL, rng, False))
    return parts


def _part(one: Placed, number: int, rng: np.random.Generator) -> _Part:
    mesh = one.shape.mesh.copy()
    mesh.apply_transform(one.pose)
    return _looks(mesh, number, rng, rng.random() < _DARK)


def _looks(mesh: trimesh.Trimesh, number: int, rng: np.random.Generator, dark: bool) -> _Part:
    """Return a mesh with a colour, and in half of the cases a pattern of a second one."""
    color = rng.uniform(0.02, 0.12, 3) if dark else rng.uniform(0.15, 0.95, 3)
    accent = rng.uniform(0.1, 0.95, 3) if rng.random() < _TEXTURED else color
    return _Part(mesh, number, color, accent, rng.uniform(-120.0, 120.0, (2, 3)), dark)


def _visible(
    scene: open3d.t.geometry.RaycastingScene, points: np.ndarray, normals: np.ndarray, place: np.ndarray
) -> np.ndarray:
    """Return whether each point (H, W, 3) is seen from a place (3,)."""
    toward = place - points
    side = np.sign((normals * toward).sum(axis=-1, keepdims=True))
    start = points + 5e-4 * side * normals
    rays = np.concatenate((start, place - start), axis=-1).astype(np.float32)
    return ~scene.test_occlusions(open3d.core.Tensor(rays), tnear=0.0, tfar=1.0).numpy()


def _colors(
    parts: list[_Part],
    own: np.ndarray,
    points: np.ndarray,
    normals: np.ndarray,
    lamp: np.ndarray,
    shade: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:
    """Return the picture (H, W, 3) uint8 RGB: diffuse surfaces under one lamp and a bright room."""
    first, second = (np.array([getattr(part, name) for part in parts])[own] for name in ("color", "accent"))
    waves = np.array([part.waves for part in parts])[own]
    pattern = np.sin(np.einsum("hwkc,hwc->hwk", waves, points)).prod(axis=-1) > 0.25
    base = np.where(pattern[..., None], second, first)
    toward = lamp - points
    toward /= np.linalg.norm(toward, axis=-1, keepdims=True)
    lit = np.abs((normals * toward).sum(axis=-1)) * ~shade
    bright = base * (0.45 + 0.55 * lit)[..., None] + rng.normal(0.0, 0.012, base.shape)
    return (255 * np.clip(bright, 0.0, 1.0) ** (1 / 2.2)).astype(np.uint8)
