"""Rigid blocks: structures and single objects that are placed as a whole."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull

from structdiffusion.composition.items import Item
from structdiffusion.footprints import outline_centroid
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.structures.bodies import PlacedBody


@dataclass(frozen=True)
class Block:
    """Some objects with fixed places to each other, about the centre of their hull.

    Attributes:
        bodies: index -> body, at its pose with the block's origin at that of the world.
        motions: (4, 4) by index: from where each stands now to there.
        centre: (2,) the point to which the position slots refer, about the origin.
        quality: in [0, 1], how good the planner that proposed it thinks it is.
    """

    bodies: Mapping[int, PlacedBody]
    motions: Mapping[int, np.ndarray]
    centre: np.ndarray
    quality: float = 1.0

    @classmethod
    def of(
        cls,
        items: Mapping[int, Item],
        motions: Mapping[int, np.ndarray],
        centre: np.ndarray | None = None,
        quality: float = 1.0,
        bodies: Mapping[int, PlacedBody] | None = None,
    ) -> Block:
        """Make the block of objects at given motions (4, 4), wherever in the world these bring them.

        Args:
            items: by index.
            motions: by index.
            centre: (2,) world, the point to which the position slots refer; by default the middle of the hull.
            quality: in [0, 1].
            bodies: the objects there, for motions that are not upright.
        """
        placed = bodies or {i: items[i].body_after(motion) for i, motion in motions.items()}
        outlines = [body.footprint for body in placed.values()]
        points = np.concatenate(outlines)
        middle = (
            next(iter(placed.values())).centroid
            if len(placed) == 1
            else outline_centroid(points[ConvexHull(points).vertices])
        )
        back = pose_from_xyz_yaw(-middle[0], -middle[1], 0.0, 0.0)
        own = {i: _shifted(body, -middle) for i, body in placed.items()}
        centre = np.zeros(2) if centre is None else np.asarray(centre) - middle
        return cls(own, {i: back @ motion for i, motion in motions.items()}, centre, quality)

    @property
    def members(self) -> tuple[int, ...]:
        """Return the indices of its objects."""
        return tuple(self.bodies)

    @cached_property
    def points(self) -> np.ndarray:
        """Return every corner (P, 2) of its outlines, about the origin."""
        return np.concatenate([body.footprint for body in self.bodies.values()])

    def bodies_at(self, place: np.ndarray) -> dict[int, PlacedBody]:
        """Return the bodies of its objects with its origin at a place (2,)."""
        return {i: _shifted(body, place) for i, body in self.bodies.items()}

    def motions_at(self, place: np.ndarray) -> dict[int, np.ndarray]:
        """Return the motions (4, 4) of its objects with its origin at a place (2,)."""
        shift = pose_from_xyz_yaw(place[0], place[1], 0.0, 0.0)
        return {i: shift @ motion for i, motion in self.motions.items()}

    def lifted(self, height: float) -> Block:
        """Return the block, higher by `height` metres."""
        up = pose_from_xyz_yaw(0.0, 0.0, height, 0.0)
        bodies = {
            i: replace(body, z_bottom=body.z_bottom + height, z_top=body.z_top + height)
            for i, body in self.bodies.items()
        }
        return replace(self, bodies=bodies, motions={i: up @ motion for i, motion in self.motions.items()})


def _shifted(body: PlacedBody, by: np.ndarray) -> PlacedBody:
    return replace(body, footprint=body.footprint + by, centroid=body.centroid + by)
