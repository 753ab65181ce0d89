"""Make drawn scenes hard to perceive: stacks, touching and hidden objects, seen from four sides by three sensors.

The objects keep their number and their kinds, so that the instruction of the scene still fits; only their places are
drawn again. World frame, metres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely

from agent.scenes.table_scene import TableScene
from agent.synthetic_tables.sensors import SENSORS, DepthSensor, facing, measured, shadowed
from structdiffusion.data.scene_sampling import DrawnScene, SceneError
from structdiffusion.footprints import clear_gap, turned
from structdiffusion.geometry import pose_from_xyz_yaw, tilt_between, transform_points
from structdiffusion.simulation.depth_camera import DepthCamera, camera_at
from structdiffusion.simulation.scenery import backdrop
from structdiffusion.simulation.visible_points import MIN_POINTS
from structdiffusion.simulation.world import TabletopWorld

SIDES = ("the arm's", "left", "opposite", "right")  # of the table, where the camera stands
_ATTEMPTS = 40
_TARGET = (0.45, 0.0, 0.03)  # the middle of the table
_DISTANCE, _RISE, _TURN = (0.75, 1.1), (32.0, 60.0), 35.0  # m and degrees of the camera's place
_GAP, _BEHIND = 0.006, (0.01, 0.07)  # m between objects that are beside each other, or one behind the other
_JOINT = 0.0015  # m at most between objects that touch
_OFFSET = 0.4  # of the lower object's radius, by which what stands on it is off its middle at most
_WIDER = 1.3  # times as wide as what carries it an object may be
_LEAST = 400  # pixels of every object
_SHOWN = (0.25, 0.85)  # share of a hidden object that is seen
_SETTLED, _FALLEN_OVER, _SUNK = 1.5, math.radians(8.0), 0.001  # s, and what is no longer as it was put; m
_DARK = 0.1  # share of objects that are dark or shiny
_FAR = 10.0  # m: what no surface is at


@dataclass(frozen=True)
class Condition:
    """What makes a scene hard: how objects stand, from which side they are seen, and by which sensor."""

    kind: str
    side: str
    sensor: DepthSensor


@dataclass(frozen=True)
class View:
    """What a sensor measures.

    Attributes:
        camera: with the sensor's lens.
        color: (H, W, 3) uint8.
        depth: (H, W) metres, NaN where nothing was measured.
        masks: (M, H, W) bool, the measured pixels of each object.
    """

    camera: DepthCamera
    color: np.ndarray
    depth: np.ndarray
    masks: np.ndarray


@dataclass(frozen=True)
class HardScene:
    """New places for a drawn scene's objects, and what is seen of them.

    Attributes:
        world_from_initial: (M, 4, 4).
        view: what the sensor measures.
    """

    world_from_initial: np.ndarray
    view: View


def condition_of(structure: int, number: int) -> Condition:
    """Return the condition of a scene: all kinds, sides and sensors come in turn.

    Args:
        structure, number: indices of the structure, and of the scene of it.
    """
    kind = list(_ARRANGED)[number % len(_ARRANGED)]
    side = SIDES[(number // len(_ARRANGED) + number + structure) % len(SIDES)]
    return Condition(kind, side, SENSORS[(number + structure) % len(SENSORS)])


def hard_scene(drawn: DrawnScene, condition: Condition, rng: np.random.Generator) -> HardScene:
    """Draw places for the objects of a scene under a condition, so that a part of every object is measured.

    Raises:
        SceneError: if these objects find no such places.
    """
    for _ in range(_ATTEMPTS):
        camera = _camera(condition, rng)
        places = _Places(drawn, camera, rng)
        try:
            hidden = _ARRANGED[condition.kind](places)
            poses = _settled(drawn, places.poses)
            return HardScene(poses, _seen(drawn, poses, camera, condition.sensor, hidden, rng))
        except SceneError:
            continue
    raise SceneError(f"no {condition.kind} scene of these objects in {_ATTEMPTS} attempts")


class _Places:
    """The places of a scene's objects while they are drawn again."""

    def __init__(self, drawn: DrawnScene, camera: DepthCamera, rng: np.random.Generator) -> None:
        self.models, self.table, self.rng = drawn.models, drawn.table, rng
        self.poses = drawn.world_from_initial.copy()
        self.eye = np.array(camera.eye)

    def outline(self, index: int) -> np.ndarray:
        """Return an object's outline (K, 2) seen from above."""
        pose = self.poses[index]
        return turned(self.models[index].footprint, math.atan2(pose[1, 0], pose[0, 0])) + pose[:2, 3]

    def shuffled(self) -> list[int]:
        """Return the indices of the objects that stand on the table, in any order."""
        return [int(k) for k in self.rng.permutation(len(self.models)) if self.poses[k, 2, 3] < _JOINT]

    def move(self, index: int, at: np.ndarray, gap: float) -> bool:
        """Move an object to a place (2,) with a new direction, if it is free there."""
        before = self.poses[index].copy()
        self.poses[index] = pose_from_xyz_yaw(at[0], at[1], 0.0, self.rng.uniform(-math.pi, math.pi))
        if self._is_free(index, gap):
            return True
        self.poses[index] = before
        return False

    def stack(self) -> None:
        """Set one object on another."""
        for under in self.shuffled():
            for over in self.shuffled():
                lower, upper = self.models[under], self.models[over]
                fits = lower.stackable and upper.flat_bottom and upper.radius < _WIDER * lower.radius
                if over == under or not fits or self._carries(over):
                    continue
                off = _OFFSET * lower.radius * self.rng.uniform(0.0, 1.0) * _direction(self.rng)
                at = self.poses[under, :2, 3] + off
                self.poses[over] = pose_from_xyz_yaw(at[0], at[1], lower.height, self.rng.uniform(-math.pi, math.pi))
                return
        raise SceneError("nothing can stand on anything")

    def touch(self) -> None:
        """Move one object so that it touches another."""
        for one in self.shuffled():
            for other in self.shuffled():
                if one != other and not self._carries(one) and self._touch(one, other):
                    return
        raise SceneError("nothing has room beside anything")

    def hide(self) -> int:
        """Move one object behind another; return its index."""
        for front in sorted(self.shuffled(), key=lambda k: -self.models[k].height):
            for back in self.shuffled():
                if back == front or self._carries(back):
                    continue
                sight = self.poses[front, :2, 3] - self.eye[:2]
                sight /= np.linalg.norm(sight)
                beside = np.array([-sight[1], sight[0]])
                away = self.models[front].radius + self.models[back].radius + self.rng.uniform(*_BEHIND)
                aside = self.rng.uniform(-1.0, 1.0) * max(self.models[front].radius, self.models[back].radius)
                if self.move(back, self.poses[front, :2, 3] + away * sight + aside * beside, _GAP):
                    return back
        raise SceneError("nothing has room behind anything")

    def _touch(self, one: int, other: int) -> bool:
        before, way, yaw = self.poses[one].copy(), _direction(self.rng), self.rng.uniform(-math.pi, math.pi)
        near, far = 0.0, self.models[one].radius + self.models[other].radius + _JOINT

        def beside(distance: float) -> np.ndarray:
            x, y = self.poses[other, :2, 3] + distance * way
            return pose_from_xyz_yaw(x, y, 0.0, yaw)

        for _ in range(16):
            away = (near + far) / 2
            self.poses[one] = beside(away)
            near, far = (near, away) if clear_gap(self.outline(one), self.outline(other)) > _JOINT / 2 else (away, far)
        self.poses[one] = beside(far)
        if self._is_free(one, 0.0):
            return True
        self.poses[one] = before
        return False

    def _carries(self, index: int) -> bool:
        outline = shapely.Polygon(self.outline(index))
        return any(pose[2, 3] > _JOINT and outline.contains(shapely.Point(pose[:2, 3])) for pose in self.poses)

    def _is_free(self, index: int, gap: float) -> bool:
        """Return whether an object stands on the table, and at a distance from the others."""
        outline = self.outline(index)
        others = (k for k in range(len(self.models)) if k != index)
        return self.table.overhang(outline) <= 0.0 and all(clear_gap(outline, self.outline(k)) > gap for k in others)


def _stacked(places: _Places) -> list[int]:
    places.stack()
    return []


def _touching(places: _Places) -> list[int]:
    places.touch()
    if len(places.models) > 3:
        places.touch()
    return []


def _occluded(places: _Places) -> list[int]:
    return [places.hide()]


def _mixed(places: _Places) -> list[int]:
    places.stack()
    if len(places.shuffled()) < 2:
        return []
    places.touch()
    return [places.hide()] if len(places.models) > 4 else []


_ARRANGED = {"stacked": _stacked, "touching": _touching, "occluded": _occluded, "mixed": _mixed}
KINDS = tuple(_ARRANGED)


def _direction(rng: np.random.Generator) -> np.ndarray:
    angle = rng.uniform(-math.pi, math.pi)
    return np.array([math.cos(angle), math.sin(angle)])


def _camera(condition: Condition, rng: np.random.Generator) -> DepthCamera:
    """Return a camera on one side of the table that looks at its middle."""
    turn = -math.pi / 2 * SIDES.index(condition.side) + math.radians(rng.uniform(-_TURN, _TURN))
    rise, distance = math.radians(rng.uniform(*_RISE)), rng.uniform(*_DISTANCE)
    back = np.array([-math.cos(rise) * math.cos(turn), -math.cos(rise) * math.sin(turn), math.sin(rise)])
    aim = DepthCamera(tuple((np.array(_TARGET) + distance * back).tolist()), _TARGET)
    return camera_at(aim.world_from_camera, focal=condition.sensor.focal)


def _settled(drawn: DrawnScene, poses: np.ndarray) -> np.ndarray:
    """Return the poses (M, 4, 4) in which the objects come to rest.

    Raises:
        SceneError: if one of them falls over, is inside another, or reaches beyond the table.
    """
    with TabletopWorld(drawn.models, list(poses), drawn.table) as world:
        world.settle(_SETTLED)
        rest = np.array(world.poses())
        sunk = min((min(world.clearances(k).values(), default=0.0) for k in range(len(poses))), default=0.0)
    fell = any(tilt_between(now, before) > _FALLEN_OVER for now, before in zip(rest, poses, strict=True))
    if fell or sunk < -_SUNK or np.abs(rest[:, :3, 3] - poses[:, :3, 3]).max() > 10 * _JOINT:
        raise SceneError("an object does not stay where it is put")
    for model, pose in zip(drawn.models, rest, strict=True):
        if drawn.table.overhang(transform_points(pose, np.concatenate(model.hulls))[:, :2]) > 0.0:
            raise SceneError("an object reaches beyond the table")
    return rest


def _seen(
    drawn: DrawnScene,
    poses: np.ndarray,
    camera: DepthCamera,
    sensor: DepthSensor,
    hidden: list[int],
    rng: np.random.Generator,
) -> View:
    """Return what the sensor measures of a table with its legs, the arm with its pedestal, and the floor.

    Raises:
        SceneError: if too little of an object is measured, or it is cut by the picture's border, or not as hidden as it
            should be.
    """
    with TableScene(drawn.models, poses, len(poses), np.random.default_rng(0)) as table:
        seen, usual, bodies = table.world.look(camera=camera), table.world.look(), table.world.bodies
        behind = backdrop(camera, table.world.ground, tuple(table.arm.kinematics.world_from_base[:3, 3].tolist()))
    body = np.where(seen.depth <= behind.depth, seen.segmentation, -1)
    border = np.concatenate((body[0], body[-1], body[:, 0], body[:, -1]))
    for one in bodies:
        if (body == one).sum() < _LEAST or (usual.segmentation == one).sum() < 2 * MIN_POINTS or (border == one).any():
            raise SceneError("an object is not seen")
    for index in hidden:
        with TabletopWorld([drawn.models[index]], [poses[index]], drawn.table) as world:
            alone = (world.look(camera=camera).segmentation == world.bodies[0]).sum()
        if not _SHOWN[0] < (body == bodies[index]).sum() / alone < _SHOWN[1]:
            raise SceneError("an object is hidden too much, or too little")
    depth = np.fmin(np.fmin(seen.depth, behind.depth), _FAR)
    dark = np.isin(body, [one for one in bodies if rng.random() < _DARK])
    depth = measured(depth, facing(depth, sensor.focal), shadowed(depth, sensor), dark, sensor, rng)
    masks = np.array([(body == one) & np.isfinite(depth) for one in bodies])
    if masks.sum(axis=(1, 2)).min() < _LEAST:
        raise SceneError("too little of an object is measured")
    return View(camera, behind.behind(seen.color, seen.depth), depth, masks)
