"""The model of one rigid object: its surface, convex parts, footprint and resting pose.

The object frame has z up in the resting pose, z = 0 at the lowest point, and the origin's x and y at the footprint's
area centroid. +x is the front: the end of a fork, knife, spoon or spatula that points away from the diner, or the side
opposite the handle of a pan; it is arbitrary for round objects.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from structdiffusion.footprints import outline_centroid
from structdiffusion.objects.rigid_body import MassProperties, mass_properties, solid_content, surface_content

SURFACE_POINTS = 1024
TALL = 1.5  # height over width of what people call tall: a brick on end is, a cube is not


class ObjectError(ValueError):
    """An object that cannot be used; the message names it and the reason."""


@dataclass(frozen=True)
class ObjectModel:
    """A rigid object in its resting pose. Lengths in metres, mass in kilograms.

    Attributes:
        name: unique in its library, such as "025_mug".
        category: its noun, such as "mug".
        source: "procedural", "blocks", "random_urdfs", "ycb", "folder", or "recorded" for an object completed from its
            cloud.
        hulls: convex parts, each (V, 3) vertices; their union is the collision body.
        surface_points: (1024, 3) float32, uniform on the outer surface.
        surface_normals: (1024, 3) float32, outward unit normals.
        mass: kilograms.
        friction: lateral friction coefficient.
        color: RGB in [0, 1].
        mesh_vertices: (V, 3), the visual surface.
        mesh_faces: (F, 3) int.
        file: the mesh file that it was read from, followed by the name of its node where that holds several objects.
    """

    name: str
    category: str
    source: str
    hulls: tuple[np.ndarray, ...]
    surface_points: np.ndarray
    surface_normals: np.ndarray
    mass: float
    friction: float
    color: tuple[float, float, float]
    mesh_vertices: np.ndarray
    mesh_faces: np.ndarray
    file: Path | None = None

    @cached_property
    def footprint(self) -> np.ndarray:
        """Return the convex outline (K, 2), counter-clockwise, of the object seen from above."""
        points = np.concatenate(self.hulls)[:, :2]
        return points[ConvexHull(points).vertices]

    @cached_property
    def mass_properties(self) -> MassProperties:
        """Return the mass properties of the object."""
        return mass_properties(self.hulls, self.mass)

    @cached_property
    def solid(self) -> bytes:
        """Return the content of the Wavefront file of its collision body; every world that it stands in loads it."""
        return solid_content(self.hulls)

    @cached_property
    def surface(self) -> bytes:
        """Return the content of the Wavefront file of its visual surface."""
        return surface_content(self.mesh_vertices, self.mesh_faces)

    @cached_property
    def height(self) -> float:
        """Return the z of the top in the resting pose, metres."""
        return float(max(hull[:, 2].max() for hull in self.hulls))

    @cached_property
    def radius(self) -> float:
        """Return the distance from the origin to the farthest footprint point, metres."""
        return float(np.linalg.norm(self.footprint, axis=1).max())

    @cached_property
    def tall(self) -> bool:
        """Return whether it lies on its side, and not on another end, once it has been tipped over."""
        return self.height > TALL * float(np.ptp(self.footprint, axis=0).min())

    @cached_property
    def stackable(self) -> bool:
        """Return whether another object can stand on it: its top 4 mm is level and spans most of the footprint.

        The top of a bowl or cup is its rim. The result depends on the surface, not on the category.
        """
        top = self.surface_points[self.surface_points[:, 2] > self.height - 0.004][:, :2]
        if len(top) < 8:
            return False
        try:
            area = ConvexHull(top).volume  # in 2-d, volume is the area
        except QhullError:  # all points on one line: an edge, not a top
            return False
        return area > 0.55 * ConvexHull(self.footprint).volume

    @cached_property
    def flat_bottom(self) -> bool:
        """Return whether it can stand on a level top: its lowest 1.5 mm span a good part of the footprint.

        A ball's contact spreads with height (the lowest 1.5 mm span 0.3 of what the lowest 5 mm do), a flat
        bottom's does not.
        """
        low, near = self._bottom_area(0.0015), self._bottom_area(0.005)
        return low > 0.5 * near and low > 0.15 * ConvexHull(self.footprint).volume

    def _bottom_area(self, height: float) -> float:
        """Return the area, m^2, of the convex outline of the surface below `height` metres."""
        points = self.surface_points[self.surface_points[:, 2] < height][:, :2]
        try:
            return float(ConvexHull(points).volume)  # in 2-d, volume is the area
        except (QhullError, ValueError):  # a point or an edge
            return 0.0


def footprint_centroid(points_xy: np.ndarray) -> np.ndarray:
    """Return the area centroid (2,) of the convex hull of points (P, 2)."""
    return outline_centroid(points_xy[ConvexHull(points_xy).vertices])


def unique_names(models: Sequence[ObjectModel]) -> list[str]:
    """Name each object by its category, numbered if several have the same category."""
    total, seen = Counter(model.category for model in models), Counter[str]()
    names = []
    for category in (model.category for model in models):
        seen[category] += 1
        names.append(f"{category} {seen[category]}" if total[category] > 1 else category)
    return names
