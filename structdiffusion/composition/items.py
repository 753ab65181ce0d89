"""The objects on the table, with bodies completed from partial clouds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely

from structdiffusion.completion.bodies import completed_bodies_of
from structdiffusion.completion.estimate import ObjectEstimate, estimate
from structdiffusion.footprints import outline_centroid, turned
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import ObjectCloud, Scene, Table
from structdiffusion.relations.figure import Standing
from structdiffusion.structures.bodies import LayoutItem, PlacedBody

_ON_TABLE = 0.008  # m: what is lifted less stands on the table


@dataclass(frozen=True)
class Item:
    """One object as it stands, with its completed body. World frame, metres.

    Attributes:
        index: among the scene's objects, then its distractors.
        cloud: its observed cloud.
        seen: estimates from the cloud, as if it stood on the table.
        model: its completed body.
        pose: (4, 4) world_from_object of that body.
        hollow: whether something can lie in it: the camera sees into it, or its completed body is open at the top.
    """

    index: int
    cloud: ObjectCloud
    seen: ObjectEstimate
    model: ObjectModel
    pose: np.ndarray
    hollow: bool

    @property
    def name(self) -> str:
        """Return its name in reports."""
        return self.cloud.name

    @cached_property
    def outline(self) -> np.ndarray:
        """Return the outline (K, 2) of the completed body in its present place, counter-clockwise."""
        yaw = math.atan2(self.pose[1, 0], self.pose[0, 0])
        return turned(self.model.footprint, yaw) + self.pose[:2, 3]

    @cached_property
    def centroid(self) -> np.ndarray:
        """Return the centroid (2,) of its outline."""
        return outline_centroid(self.outline)

    @property
    def bottom(self) -> float:
        """Return z of the surface below it."""
        return self.cloud.bottom

    @property
    def top(self) -> float:
        """Return z of its top in its present place."""
        return self.cloud.bottom + self.model.height

    def layout_item(self) -> LayoutItem:
        """Return the object as layouts see it."""
        seen = self.seen
        return LayoutItem(
            self.cloud.category, self.outline - self.centroid, self.model.height, seen.front_yaw, seen.stackable, True
        )

    def motion_to(self, place: Sequence[float], turn: float, bottom: float) -> np.ndarray:
        """Return the motion (4, 4) that turns it about its centroid, brings that to a place (2,), and its bottom to a
        height.
        """
        motion = pose_from_xyz_yaw(0.0, 0.0, 0.0, turn)
        motion[:2, 3] = np.asarray(place) - motion[:2, :2] @ self.centroid
        motion[2, 3] = bottom - self.bottom
        return motion

    def body_after(self, motion: np.ndarray, rests_on: tuple[int, ...] = ()) -> PlacedBody:
        """Return it as checks see it after an upright motion (4, 4)."""
        turn = math.atan2(motion[1, 0], motion[0, 0])
        outline = turned(self.outline, turn) + motion[:2, 3]
        low = self.bottom + float(motion[2, 3])
        return PlacedBody(
            self.name, self.cloud.category, outline, outline_centroid(outline), low, low + self.model.height,
            self.seen.front_yaw + turn, rests_on,
        )  # fmt: skip


@dataclass(frozen=True)
class TableState:
    """Everything that stands on the table.

    Attributes:
        items: the scene's N objects, then its distractors.
        count: N.
        table: the table top.
    """

    items: tuple[Item, ...]
    count: int
    table: Table

    @classmethod
    def of(cls, scene: Scene) -> TableState:
        """Complete the bodies of a scene."""
        clouds = (*scene.objects, *scene.distractors)
        flat = scene.on_the_table()
        bodies = completed_bodies_of(clouds, scene.world_from_camera)
        lowered = (*flat.objects, *flat.distractors)
        items: list[Item] = []
        for cloud, low, (shape, model, pose) in zip(clouds, lowered, bodies, strict=True):
            seen = estimate(low)
            items.append(Item(len(items), cloud, seen, model, pose, seen.hollow or shape.hollow))
        return cls(tuple(items), len(scene.objects), scene.table)

    @property
    def bodies(self) -> list[tuple[ObjectModel, np.ndarray]]:
        """Return the completed bodies, each with its pose world_from_object (4, 4)."""
        return [(item.model, item.pose) for item in self.items]

    @cached_property
    def carriers(self) -> Mapping[int, int]:
        """Return for each item that stands on another one the index of that."""
        carriers: dict[int, int] = {}
        for item in self.items:
            if item.bottom < _ON_TABLE:
                continue
            middle = shapely.Point(item.centroid)
            below = [
                other
                for other in self.items
                if other is not item
                and other.bottom < item.bottom
                and shapely.Polygon(other.outline).intersects(middle)
            ]
            if below:
                carriers[item.index] = min(below, key=lambda other: abs(other.top - item.bottom)).index
        return carriers

    def carried_by(self, index: int) -> list[int]:
        """Return the items that stand on an item, directly or indirectly."""
        above = [i for i, carrier in self.carriers.items() if carrier == index]
        return above + [j for i in above for j in self.carried_by(i)]

    def standing(self, bodies: Mapping[int, PlacedBody] | None = None) -> Standing:
        """Return the table with some items at other places than now."""
        if not bodies:
            return self._as_it_is
        there = tuple(bodies.get(i, body) for i, body in enumerate(self._as_it_is.bodies))
        return replace(self._as_it_is, bodies=there)

    @cached_property
    def _as_it_is(self) -> Standing:
        there = tuple(
            item.body_after(np.eye(4), (self.carriers[item.index],) if item.index in self.carriers else ())
            for item in self.items
        )
        return Standing(there, np.array([item.centroid for item in self.items]), ((),) * len(there), self.table)
