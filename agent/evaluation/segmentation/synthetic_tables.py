"""Draw and render synthetic tables with true labels: objects on a table, above a floor and often before a wall."""

from __future__ import annotations

import math

import numpy as np
import trimesh

from agent.evaluation.segmentation.labelled_clouds import LabelledCloud
from agent.synthetic_tables.arrangements import ARRANGEMENTS, Arrangement, NoRoom
from agent.synthetic_tables.rendering import (
    FLOOR,
    TABLE,
    WALL,
    Part,
    camera_pose,
    camera_rays,
    cast,
    colors,
    facing,
    looks,
    object_part,
    printed_part,
    ray_scene,
    visible,
)
from agent.synthetic_tables.sensors import SENSORS, measured
from agent.synthetic_tables.shapes import PARTS
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points

_WIDTH, _HEIGHT = 640, 480
_DRAWS = 200
_LEAST = 400  # measured pixels of every object
_THICK = 0.03  # m of the table's board


def synthetic_table(kind: str, part: str, seed: int, number: int, printed: bool = False) -> LabelledCloud:
    """Draw a table and what a depth camera sees of it.

    Args:
        kind: of arrangement, a key of `ARRANGEMENTS`.
        part: "development" or "test": which objects there are.
        seed, number: the same two give the same table.
        printed: whether the objects have labels, bands, caps and other prints.
    """
    for draw in range(_DRAWS):
        rng = np.random.default_rng((seed, list(PARTS).index(part), list(ARRANGEMENTS).index(kind), number, draw))
        half = np.array([rng.uniform(0.32, 0.5), rng.uniform(0.35, 0.7)])
        scene = Arrangement(PARTS[part], half, rng)
        try:
            ARRANGEMENTS[kind](scene)
        except NoRoom:
            continue
        cloud = _seen(scene, half, kind, f"{kind} {number}", printed, rng)
        if cloud is not None:
            return cloud
    raise RuntimeError(f"no table of the kind {kind!r} could be drawn in {_DRAWS} attempts")


def _seen(
    arranged: Arrangement, half: np.ndarray, kind: str, name: str, printed: bool, rng: np.random.Generator
) -> LabelledCloud | None:
    """Render a scene; `None` if too little of an object is seen, or one is cut by the picture's border."""
    sensor = SENSORS[int(rng.integers(len(SENSORS)))]
    camera = _camera(rng)
    placed, drawn = arranged.placed, printed_part if printed else object_part
    parts = [
        *_surroundings(half, rng, arranged.at_wall),
        *(drawn(one.shape.mesh, one.pose, index + 1, rng) for index, one in enumerate(placed)),
    ]
    scene = ray_scene(parts)
    rays = camera_rays(camera, sensor.focal, _WIDTH, _HEIGHT)
    hits = cast(scene, rays)
    truth = np.where(hits.there, np.array([part.number for part in parts])[hits.own], FLOOR)
    border = np.concatenate((truth[0], truth[-1], truth[:, 0], truth[:, -1]))
    if _seen_least(truth, len(placed)) < 1.5 * _LEAST or border.max() > TABLE:
        return None
    eye = transform_points(camera, np.array([[sensor.baseline, 0.0, 0.0]]))[0]
    lamp = np.array([*rng.uniform(-1.5, 1.5, 2), rng.uniform(1.2, 2.5)])
    shadow, shade = (hits.there & ~visible(scene, hits, place) for place in (eye, lamp))
    dark = np.array([part.dark for part in parts])[hits.own]
    # Rays are not normalised: their length is the depth along the camera's axis.
    depth = measured(hits.distance, facing(hits, rays), shadow, dark, sensor, rng)
    truth = np.where(np.isfinite(depth), truth, FLOOR)
    if _seen_least(truth, len(placed)) < _LEAST:
        return None
    color = colors(parts, hits, lamp, shade, rng)
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
    return camera_pose(eye, (target - eye) / distance, roll)


def _surroundings(half: np.ndarray, rng: np.random.Generator, at_wall: bool) -> list[Part]:
    """Return the table, the floor, and in two of three scenes a wall; always one where the table stands at it."""
    table = trimesh.creation.box((2 * half[0], 2 * half[1], _THICK))
    table.apply_translation((0.0, 0.0, -_THICK / 2))
    floor = trimesh.creation.box((8.0, 8.0, 0.01))
    floor.apply_translation((1.5, 0.0, -rng.uniform(0.45, 0.8)))
    parts = [looks(table, TABLE, rng, False), looks(floor, FLOOR, rng, False)]
    if at_wall or rng.random() < 0.67:
        wall = trimesh.creation.box((0.02, 8.0, 4.0))
        turn = rng.uniform(-0.3, 0.3)
        # As near as it may stand without cutting through a corner of the table.
        behind = half[0] * math.cos(turn) + half[1] * abs(math.sin(turn)) + 0.01
        wall.apply_translation((behind + rng.uniform(0.01, 0.03 if at_wall else 0.6), 0.0, 0.5))
        wall.apply_transform(pose_from_xyz_yaw(0.0, 0.0, 0.0, turn))
        parts.append(looks(wall, WALL, rng, False))
    return parts
