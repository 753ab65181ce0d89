"""Arrange objects on synthetic tables: apart, touching, stacked, inside others, hidden, mixed, at the table's edge, cut
in two by others, flat, in a row that divides the table, before a wall; and tables without any.

Frame: z = 0 is the table's surface and the origin its middle; the camera looks along +x. Lengths in metres.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from agent.synthetic_tables.shapes import Draw, Family, Shape, placed_footprint
from structdiffusion.geometry import pose_from_xyz_yaw

_ATTEMPTS = 60
_GAP = 0.03  # between objects that stand apart
_CLOSE = 0.006  # between those of clutter
_MOST_JOINT = 0.0015  # between objects that touch
_BISECTIONS = 18
_FAR = 0.6
_NARROW = 0.42  # half the length of a table of which the picture shows both sides
_WIDER = 1.5  # times as wide as what it stands on an object may be


class NoRoom(Exception):
    """Raised when an object finds no place; the scene is then drawn again."""


@dataclass(frozen=True)
class Placed:
    """An object at its place.

    Attributes:
        shape: the object.
        pose: (4, 4), table frame.
        on: index of the object that it stands on or in; `None` for the table.
    """

    shape: Shape
    pose: np.ndarray
    on: int | None = None


class Arrangement:
    """Objects that are placed one after the other.

    Args:
        family: the objects to draw from.
        half: (2,) half the table's length along x and y.
        rng: the only source of randomness.

    Attributes:
        placed: the objects so far.
        at_wall: whether the table stands at a wall.
    """

    def __init__(self, family: Family, half: np.ndarray, rng: np.random.Generator) -> None:
        self.family, self.rng, self.placed = family, rng, list[Placed]()
        self.at_wall = False
        self._half = half
        # What stands outside the picture's middle would not be seen whole.
        self._reach = float(min(0.3, half.min() - 0.04))

    def one_of(self, draws: Sequence[Draw]) -> Shape:
        """Draw an object."""
        return draws[int(self.rng.integers(len(draws)))](self.rng)

    def stand(self, shape: Shape, gap: float = _GAP, middle: tuple[float, float] = (0.0, 0.0)) -> int:
        """Place an object on the table at a distance from all others; return its index."""
        for _ in range(_ATTEMPTS):
            x, y = self.rng.uniform(-self._reach, self._reach, 2) + middle
            pose = pose_from_xyz_yaw(x, y, 0.0, self.rng.uniform(-math.pi, math.pi))
            if self._free(placed_footprint(shape, pose), gap):
                return self.put(shape, pose)
        raise NoRoom

    def touch(self, shape: Shape, other: int) -> int:
        """Place an object so that it touches another, flush with one of its sides in half of the cases."""
        anchor = self.placed[other]
        yaw = math.atan2(anchor.pose[1, 0], anchor.pose[0, 0])
        outline = placed_footprint(anchor.shape, anchor.pose)
        for _ in range(_ATTEMPTS):
            flush = self.rng.random() < 0.5
            way = yaw + math.pi / 2 * self.rng.integers(4) if flush else self.rng.uniform(-math.pi, math.pi)
            turn = yaw + math.pi / 2 * self.rng.integers(2) if flush else self.rng.uniform(-math.pi, math.pi)
            near, far, joint = 0.0, _FAR, self.rng.uniform(0.0, _MOST_JOINT)
            for _ in range(_BISECTIONS):
                between = (near + far) / 2
                pose = pose_from_xyz_yaw(*self._beside(anchor, way, between), 0.0, turn)
                if placed_footprint(shape, pose).distance(outline) > joint:
                    far = between
                else:
                    near = between
            pose = pose_from_xyz_yaw(*self._beside(anchor, way, far), 0.0, turn)
            if self._free(placed_footprint(shape, pose), 0.0):
                return self.put(shape, pose)
        raise NoRoom

    def stack(self, shape: Shape, below: int) -> int:
        """Set an object on another, its middle over the other's top."""
        under = self.placed[below]
        if under.shape.top <= 0.0 or shape.top > _WIDER * under.shape.top:
            raise NoRoom
        off = self.rng.uniform(0.0, 0.5 * under.shape.top)
        return self.put(shape, self._above(under, off, under.shape.height), below)

    def put_inside(self, shape: Shape, vessel: int) -> int:
        """Set an object into a hollow one."""
        under = self.placed[vessel]
        if under.shape.floor is None:
            raise NoRoom
        height, radius = under.shape.floor
        own = float(np.linalg.norm(np.array(shape.footprint.exterior.coords), axis=1).max())
        if own > radius + 0.01:
            raise NoRoom
        return self.put(shape, self._above(under, self.rng.uniform(0.0, max(0.0, radius - own)), height), vessel)

    def hide(self, shape: Shape, front: int) -> int:
        """Place an object behind another, so that the camera sees part of it."""
        before = self.placed[front]
        width = placed_footprint(before.shape, before.pose).bounds
        for _ in range(_ATTEMPTS):
            x = width[2] + self.rng.uniform(0.05, 0.16)
            y = before.pose[1, 3] + self.rng.uniform(-0.09, 0.09)
            pose = pose_from_xyz_yaw(x, y, 0.0, self.rng.uniform(-math.pi, math.pi))
            if self._free(placed_footprint(shape, pose), 0.02):
                return self.put(shape, pose)
        raise NoRoom

    def divide(self, shape: Shape, front: int) -> int:
        """Place a long object behind a narrower one, so that the camera sees it on both sides of that."""
        before = self.placed[front]
        near, far = placed_footprint(before.shape, before.pose).bounds[1::2]
        if np.ptp(shape.footprint.bounds[::2]) < 1.5 * (far - near):
            raise NoRoom
        for _ in range(_ATTEMPTS):
            yaw = math.pi / 2 + self.rng.uniform(-0.4, 0.4)
            x = before.pose[0, 3] + self.rng.uniform(0.08, 0.16)
            pose = pose_from_xyz_yaw(x, before.pose[1, 3] + self.rng.uniform(-0.02, 0.02), 0.0, yaw)
            if self._free(placed_footprint(shape, pose), 0.01):
                return self.put(shape, pose)
        raise NoRoom

    def line_up(self, draws: Sequence[Draw]) -> None:
        """Set objects in a row from one side of a narrow table to the other, each close to the last."""
        if self._half[1] > _NARROW:
            raise NoRoom
        x, y = self.rng.uniform(-0.08, 0.02), -self._half[1] + 0.02
        while y < self._half[1] - 0.05:
            shape = self.one_of(draws)
            pose = pose_from_xyz_yaw(x + self.rng.uniform(-0.02, 0.02), 0.0, 0.0, self.rng.uniform(-0.3, 0.3))
            pose[1, 3] = y - placed_footprint(shape, pose).bounds[1]
            y = placed_footprint(shape, pose).bounds[3] + self.rng.uniform(_CLOSE, 2 * _CLOSE)
            if self._free(placed_footprint(shape, pose), 0.0):
                self.put(shape, pose)

    def at_edge(self, shape: Shape, gap: float) -> int:
        """Place an object at an edge of the table."""
        for _ in range(_ATTEMPTS):
            x, y = self.rng.uniform(-self._reach, self._reach, 2)
            inset = self.rng.uniform(0.06, 0.12)
            if self.rng.random() < 0.5:
                x = -self._half[0] + inset
            else:
                y = math.copysign(self._half[1] - inset, y)
            pose = pose_from_xyz_yaw(x, y, 0.0, self.rng.uniform(-math.pi, math.pi))
            if self._free(placed_footprint(shape, pose), gap):
                return self.put(shape, pose)
        raise NoRoom

    def put(self, shape: Shape, pose: np.ndarray, on: int | None = None) -> int:
        """Place an object at a pose (4, 4), whatever is there; return its index."""
        self.placed.append(Placed(shape, pose, on))
        return len(self.placed) - 1

    def fits(self, shape: Shape, pose: np.ndarray) -> bool:
        """Return whether an object at a pose (4, 4) would lie on the table and cut no other."""
        outline = placed_footprint(shape, pose).buffer(-_MOST_JOINT)
        return self._free(outline, 0.0)

    def _above(self, under: Placed, off: float, height: float) -> np.ndarray:
        angle = self.rng.uniform(-math.pi, math.pi)
        x, y, z = under.pose[:3, 3]
        turn = self.rng.uniform(-math.pi, math.pi)
        return pose_from_xyz_yaw(x + off * math.cos(angle), y + off * math.sin(angle), z + height, turn)

    def _beside(self, anchor: Placed, way: float, distance: float) -> tuple[float, float]:
        x, y = anchor.pose[:2, 3]
        return x + distance * math.cos(way), y + distance * math.sin(way)

    def _free(self, outline: shapely.Polygon, gap: float) -> bool:
        """Return whether an outline lies on the table and at a distance from what stands there."""
        if not shapely.box(*-self._half, *self._half).contains(outline):
            return False
        return all(placed_footprint(one.shape, one.pose).distance(outline) > gap for one in self.placed)


def _apart(scene: Arrangement) -> None:
    for _ in range(int(scene.rng.integers(3, 8))):
        scene.stand(scene.one_of(scene.family.any))


def _touching(scene: Arrangement) -> None:
    for _ in range(int(scene.rng.integers(1, 3))):
        first = scene.stand(scene.one_of(scene.family.boxes))
        second = scene.touch(scene.one_of(scene.family.boxes), first)
        if scene.rng.random() < 0.5:
            scene.touch(scene.one_of(scene.family.boxes), second)
    scene.stand(scene.one_of(scene.family.any))


def _stacked(scene: Arrangement) -> None:
    for _ in range(int(scene.rng.integers(1, 3))):
        below = scene.stand(scene.one_of(scene.family.boxes))
        above = scene.stack(scene.one_of(scene.family.boxes), below)
        if scene.rng.random() < 0.3:
            scene.stack(scene.one_of(scene.family.any), above)
    for _ in range(int(scene.rng.integers(0, 3))):
        scene.stand(scene.one_of(scene.family.any))


def _inside(scene: Arrangement) -> None:
    for _ in range(int(scene.rng.integers(1, 3))):
        vessel = scene.stand(scene.one_of(scene.family.hollow))
        scene.put_inside(scene.one_of(scene.family.small), vessel)
    for _ in range(int(scene.rng.integers(0, 3))):
        scene.stand(scene.one_of(scene.family.any))


def _occluded(scene: Arrangement) -> None:
    for side in (-0.14, 0.14)[: int(scene.rng.integers(1, 3))]:
        front = scene.stand(scene.one_of(scene.family.tall), 0.02, (-0.1, side))
        scene.hide(scene.one_of(scene.family.any), front)
    scene.stand(scene.one_of(scene.family.any), 0.02)


def _mixed(scene: Arrangement) -> None:
    below = scene.stand(scene.one_of(scene.family.boxes), _CLOSE)
    scene.stack(scene.one_of(scene.family.boxes), below)
    scene.touch(scene.one_of(scene.family.boxes), below)
    vessel = scene.stand(scene.one_of(scene.family.hollow), _CLOSE)
    if scene.rng.random() < 0.5:
        scene.put_inside(scene.one_of(scene.family.small), vessel)
    for _ in range(int(scene.rng.integers(3, 7))):
        scene.stand(scene.one_of(scene.family.any), _CLOSE)


def _edge(scene: Arrangement) -> None:
    for _ in range(int(scene.rng.integers(3, 6))):
        scene.at_edge(scene.one_of(scene.family.any), _CLOSE)
    for _ in range(int(scene.rng.integers(1, 4))):
        scene.stand(scene.one_of(scene.family.any), _CLOSE)


def _divided(scene: Arrangement) -> None:
    front = scene.stand(scene.one_of(scene.family.tall), 0.02, (-0.08, scene.rng.uniform(-0.1, 0.1)))
    scene.divide(scene.one_of(scene.family.boxes), front)
    for _ in range(int(scene.rng.integers(0, 3))):
        scene.stand(scene.one_of(scene.family.any))


def _flat(scene: Arrangement) -> None:
    for _ in range(int(scene.rng.integers(2, 4))):
        scene.stand(scene.one_of(scene.family.flat))
    scene.stand(scene.one_of(scene.family.any))


def _row(scene: Arrangement) -> None:
    scene.line_up(scene.family.tall)
    for _ in range(int(scene.rng.integers(1, 3))):
        scene.stand(scene.one_of(scene.family.any), _GAP, (0.12, 0.0))


def _wall(scene: Arrangement) -> None:
    scene.at_wall = True
    for _ in range(int(scene.rng.integers(2, 5))):
        scene.stand(scene.one_of(scene.family.any))


def _empty(scene: Arrangement) -> None:
    scene.at_wall = scene.rng.random() < 0.5


ARRANGEMENTS: dict[str, Callable[[Arrangement], None]] = {
    "apart": _apart, "touching": _touching, "stacked": _stacked, "inside": _inside, "occluded": _occluded,
    "mixed": _mixed, "edge": _edge, "divided": _divided, "flat": _flat, "row": _row, "wall": _wall, "empty": _empty,
}  # fmt: skip
