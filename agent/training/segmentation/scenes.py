"""Draw training tables: the arrangements of the development tables, clutter, rows of boxes, and the room around."""

from __future__ import annotations

import math

import numpy as np
import trimesh

from agent.synthetic_tables.arrangements import ARRANGEMENTS, Arrangement, NoRoom, Placed
from agent.synthetic_tables.rendering import (
    FLOOR,
    TABLE,
    WALL,
    Part,
    camera_pose,
    looks,
    object_part,
    of_the_same_print,
    printed_part,
)
from agent.synthetic_tables.shapes import Shape
from agent.training.segmentation.objects import TRAINING
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points

_CLUTTER = 0.6  # share of scenes that are clutter
_PRINTED, _ALIKE = 0.7, 0.5  # shares of objects with a print, and of objects of one shape with the same print
_MOST = 14  # objects of clutter
_MOST_AROUND = 4  # pieces of furniture
_THICK = 0.03  # m of the table's board


def training_scene(rng: np.random.Generator) -> tuple[list[Placed], list[Part]]:
    """Draw a table with objects, and its parts to render; the objects have the numbers from 1 on."""
    half = np.array([rng.uniform(0.3, 0.6), rng.uniform(0.3, 0.8)])
    while True:
        scene = Arrangement(TRAINING, half, rng)
        try:
            if rng.random() < _CLUTTER:
                _clutter(scene)
            else:
                ARRANGEMENTS[str(rng.choice(list(ARRANGEMENTS)))](scene)
        except NoRoom:
            if not scene.placed:
                continue
        return scene.placed, [*_room(half, rng), *_object_parts(scene.placed, rng)]


def _object_parts(placed: list[Placed], rng: np.random.Generator) -> list[Part]:
    """Return the objects with their colours; those of one shape may be of one product."""
    parts: list[Part] = []
    for index, one in enumerate(placed):
        like = next((k for k in range(index) if placed[k].shape is one.shape), None)
        if like is not None and parts[like].printed is not None and rng.random() < _ALIKE:
            parts.append(of_the_same_print(parts[like], one.shape.mesh, one.pose, index + 1))
        else:
            drawn = printed_part if rng.random() < _PRINTED else object_part
            parts.append(drawn(one.shape.mesh, one.pose, index + 1, rng))
    return parts


def _clutter(scene: Arrangement) -> None:
    """Place objects one after the other beside, on, in, behind or flush with others."""
    rng, family = scene.rng, scene.family
    for _ in range(int(rng.integers(2, _MOST + 1))):
        other = int(rng.integers(len(scene.placed))) if scene.placed else -1
        try:
            match rng.choice(6, p=(0.34, 0.16, 0.24, 0.12, 0.06, 0.08)) if other >= 0 else 0:
                case 0:
                    scene.stand(scene.one_of(family.any), rng.choice((0.0005, 0.004, 0.015, 0.03)))
                case 1:
                    scene.touch(scene.one_of(family.boxes if rng.random() < 0.6 else family.any), other)
                case 2:
                    _pile(scene, other)
                case 3:
                    vessel = scene.stand(scene.one_of(family.hollow), 0.004)
                    for _ in range(int(rng.integers(1, 3))):
                        scene.put_inside(scene.one_of(family.small), vessel)
                        if rng.random() < 0.8:  # a second one would mostly stand inside the first
                            break
                case 4:
                    scene.hide(scene.one_of(family.any), other)
                case 5:
                    _row(scene, scene.one_of(family.boxes))
        except NoRoom:
            continue


def _pile(scene: Arrangement, base: int) -> None:
    """Set objects on another: alike and flush, or of any kind, and anywhere that carries them."""
    rng = scene.rng
    below = scene.placed[base]
    carried = {one.on for one in scene.placed}
    if below.shape.top <= 0.0 or base in carried:
        below = scene.placed[base := scene.stand(scene.one_of(scene.family.boxes), 0.004)]
    for _ in range(int(rng.integers(1, 4))):
        if rng.random() < 0.2:
            pose = below.pose.copy()
            pose[2, 3] += below.shape.height
            base = scene.put(below.shape, pose, base)
        else:
            base = scene.stack(scene.one_of(scene.family.any if rng.random() < 0.4 else scene.family.boxes), base)
        below = scene.placed[base]
        if below.shape.top <= 0.0:
            return


def _row(scene: Arrangement, shape: Shape) -> None:
    """Place two to four objects of one shape flush side by side."""
    rng = scene.rng
    first = scene.stand(shape, 0.004)
    pose = scene.placed[first].pose
    low, high = shape.mesh.bounds[:, :2]
    axis = int(rng.integers(2))
    step = np.zeros(3)
    step[axis] = (high - low)[axis] + rng.uniform(0.0, 0.002)
    for number in range(1, int(rng.integers(2, 5))):
        moved = pose.copy()
        moved[:3, 3] += pose[:3, :3] @ (number * step)
        if not scene.fits(shape, moved):
            return
        scene.put(shape, moved)


def _room(half: np.ndarray, rng: np.random.Generator) -> list[Part]:
    """Return the table, the floor, walls, and furniture beside the table."""
    table = trimesh.creation.box((2 * half[0], 2 * half[1], _THICK))
    table.apply_translation((0.0, 0.0, -_THICK / 2))
    below = rng.uniform(0.3, 0.9)
    floor = trimesh.creation.box((8.0, 8.0, 0.01))
    floor.apply_translation((0.0, 0.0, -below))
    parts = [looks(table, TABLE, rng, False), looks(floor, FLOOR, rng, False)]
    reach = float(np.linalg.norm(half))
    for _ in range(int(rng.integers(0, 3))):
        wall = trimesh.creation.box((0.02, 8.0, 4.0))
        near = rng.random() < 0.3
        turn = math.pi / 2 * rng.integers(4) if near else rng.uniform(-math.pi, math.pi)
        off = abs(half[0] * math.cos(turn)) + abs(half[1] * math.sin(turn)) + 0.012 if near else reach + 0.02
        wall.apply_translation((off + rng.uniform(0.0, 0.02 if near else 0.8), 0.0, 0.5))
        wall.apply_transform(pose_from_xyz_yaw(0.0, 0.0, 0.0, turn))
        parts.append(looks(wall, WALL, rng, False))
    for _ in range(int(rng.integers(0, _MOST_AROUND + 1))):
        sides = rng.uniform(0.1, 0.6, 3)
        piece = trimesh.creation.box((*sides[:2], 2 * sides[2]))
        turn = rng.uniform(-math.pi, math.pi)
        away = reach + float(np.linalg.norm(sides[:2])) / 2 + rng.uniform(0.0, 0.6)
        piece.apply_translation((away, 0.0, sides[2] - below))
        piece.apply_transform(pose_from_xyz_yaw(0.0, 0.0, 0.0, turn))
        parts.append(looks(piece, WALL, rng, False))
    return parts


def training_camera(placed: list[Placed], rng: np.random.Generator) -> np.ndarray:
    """Return the pose (4, 4) of a camera that looks at the objects, or at the middle of an empty table, from any side;
    z forward, x right, y down.
    """
    middle = np.mean([one.pose[:2, 3] for one in placed], axis=0) if placed else np.zeros(2)
    target = np.array([*(rng.uniform(0.0, 1.0) * middle + rng.uniform(-0.08, 0.08, 2)), 0.05])
    distance, rise = rng.uniform(0.6, 1.35), math.radians(rng.uniform(18.0, 75.0))
    turn, roll = rng.uniform(-math.pi, math.pi), math.radians(rng.normal(0.0, 4.0))
    toward = np.array([-math.cos(rise) * math.cos(turn), -math.cos(rise) * math.sin(turn), math.sin(rise)])
    return camera_pose(target + distance * toward, -toward, roll)


def level_from(camera: np.ndarray) -> np.ndarray:
    """Return level_from_camera (4, 4): z up from the table's surface, x the camera's direction of view."""
    turn = math.atan2(camera[1, 2], camera[0, 2])
    level = pose_from_xyz_yaw(camera[0, 3], camera[1, 3], 0.0, turn)
    return np.linalg.inv(level) @ camera


def eye_beside(camera: np.ndarray, baseline: float) -> np.ndarray:
    """Return the place (3,) of a camera's second eye."""
    return transform_points(camera, np.array([[baseline, 0.0, 0.0]]))[0]
