"""Make the meshes of household objects for synthetic tables.

Development and test tables hold different families of objects, so that what is tuned on the former can be checked on
the latter. All meshes stand on z = 0 about the z axis; lengths in metres.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
import trimesh

from structdiffusion.geometry import transform_points

SIDES = 40  # of a round object
_WALL = 0.0035  # m: the thickness of hollow objects
Draw = Callable[[np.random.Generator], "Shape"]


@dataclass(frozen=True)
class Shape:
    """An object of a synthetic table.

    Attributes:
        kind: its family, such as "box".
        mesh: z up, its lowest point at z = 0.
        top: radius of the disc about the axis that something can stand on at the upper end; 0 where nothing can.
        floor: height and radius of the disc inside that something can stand on; `None` for solid objects.
    """

    kind: str
    mesh: trimesh.Trimesh
    top: float = 0.0
    floor: tuple[float, float] | None = None

    @property
    def height(self) -> float:
        """Return the height, metres."""
        return float(self.mesh.bounds[1, 2])

    @property
    def footprint(self) -> shapely.Polygon:
        """Return the convex outline seen from above."""
        return shapely.MultiPoint(self.mesh.vertices[:, :2]).convex_hull


def _box(rng: np.random.Generator) -> Shape:
    long, wide = rng.uniform(0.07, 0.22), rng.uniform(0.05, 0.14)
    mesh = trimesh.creation.box((long, wide, rng.uniform(0.035, 0.22)))
    return standing("box", mesh, min(long, wide) / 2)


def _flat_box(rng: np.random.Generator) -> Shape:
    long, wide = rng.uniform(0.12, 0.26), rng.uniform(0.10, 0.18)
    return standing("box", trimesh.creation.box((long, wide, rng.uniform(0.03, 0.07))), min(long, wide) / 2)


def _tin(rng: np.random.Generator) -> Shape:
    radius, height = rng.uniform(0.03, 0.055), rng.uniform(0.05, 0.15)
    return turned("tin", [(0, 0), (radius, 0), (radius, height), (0, height)], top=radius)


def _lying_roll(rng: np.random.Generator) -> Shape:
    mesh = trimesh.creation.cylinder(rng.uniform(0.025, 0.045), rng.uniform(0.1, 0.24), sections=SIDES)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 2, (0, 1, 0)))
    return standing("roll", mesh, 0.0)


def _bowl(rng: np.random.Generator) -> Shape:
    radius, height, foot = rng.uniform(0.06, 0.1), rng.uniform(0.045, 0.08), rng.uniform(0.4, 0.6)
    angles = np.linspace(0.0, math.pi / 2, 9)
    outer = [(radius * (foot + (1 - foot) * math.sin(a)), height * (1 - math.cos(a))) for a in angles]
    return hollow("bowl", outer)


def _cup(rng: np.random.Generator) -> Shape:
    radius, height = rng.uniform(0.033, 0.048), rng.uniform(0.07, 0.12)
    return hollow("cup", [(radius * rng.uniform(0.7, 0.95), 0.0), (radius, height)])


def _mug(rng: np.random.Generator) -> Shape:
    radius, height = rng.uniform(0.036, 0.045), rng.uniform(0.08, 0.105)
    ring = trimesh.creation.torus(0.28 * height, 0.005, major_sections=SIDES, minor_sections=10)
    ring.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 2, (1, 0, 0)))
    ring.apply_translation((radius + 0.008, 0.0, height / 2))
    inside = np.linalg.norm(ring.triangles_center[:, :2], axis=1) < radius - _WALL / 2
    ring.update_faces(~inside)
    return hollow("mug", [(radius, 0.0), (radius, height)], ring)


def _plate(rng: np.random.Generator) -> Shape:
    radius, height = rng.uniform(0.09, 0.125), rng.uniform(0.014, 0.025)
    return hollow("plate", [(0.6 * radius, 0.0), (0.75 * radius, 0.004), (radius, height)])


def _ball(rng: np.random.Generator) -> Shape:
    return standing("ball", trimesh.creation.icosphere(3, rng.uniform(0.025, 0.042)), 0.0)


def _knife(rng: np.random.Generator) -> Shape:
    return standing("knife", trimesh.creation.box((rng.uniform(0.16, 0.24), rng.uniform(0.016, 0.025), 0.005)), 0.0)


def _booklet(rng: np.random.Generator) -> Shape:
    long, wide = rng.uniform(0.12, 0.21), rng.uniform(0.09, 0.15)
    return standing("booklet", trimesh.creation.box((long, wide, rng.uniform(0.005, 0.009))), 0.0)


def _disc(rng: np.random.Generator) -> Shape:
    mesh = trimesh.creation.cylinder(rng.uniform(0.06, 0.11), rng.uniform(0.006, 0.009), sections=SIDES)
    return standing("disc", mesh, 0.0)


def _ruler(rng: np.random.Generator) -> Shape:
    mesh = trimesh.creation.box((rng.uniform(0.2, 0.3), rng.uniform(0.03, 0.045), rng.uniform(0.005, 0.007)))
    return standing("ruler", mesh, 0.0)


def _hexagon_mat(rng: np.random.Generator) -> Shape:
    mesh = trimesh.creation.cylinder(rng.uniform(0.06, 0.1), rng.uniform(0.005, 0.009), sections=6)
    return standing("mat", mesh, 0.0)


def _gable(rng: np.random.Generator) -> Shape:
    side, height = rng.uniform(0.06, 0.09), rng.uniform(0.12, 0.2)
    points = [(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (0.0, height)]
    points += [(x, 0.0, height + 0.35 * side) for x in (-1, 1)]
    mesh = trimesh.convex.convex_hull(np.array(points) * (side / 2, side / 2, 1.0))
    return standing("carton", mesh, 0.0)


def _rounded_box(rng: np.random.Generator) -> Shape:
    long, wide, height = rng.uniform(0.07, 0.2), rng.uniform(0.05, 0.12), rng.uniform(0.03, 0.12)
    corner = rng.uniform(0.008, 0.02)
    outline = shapely.box(-long / 2, -wide / 2, long / 2, wide / 2).buffer(-corner).buffer(corner)
    return standing("case", trimesh.creation.extrude_polygon(outline, height), min(long, wide) / 2)


def _bottle(rng: np.random.Generator) -> Shape:
    radius, height = rng.uniform(0.028, 0.042), rng.uniform(0.14, 0.24)
    neck, shoulder = rng.uniform(0.3, 0.45) * radius, rng.uniform(0.6, 0.72) * height
    profile = [(0, 0), (radius, 0), (radius, shoulder), (neck, shoulder + 0.9 * radius), (neck, height), (0, height)]
    return turned("bottle", profile)


def _jar(rng: np.random.Generator) -> Shape:
    radius, height, lid = rng.uniform(0.03, 0.048), rng.uniform(0.06, 0.12), rng.uniform(0.75, 1.08)
    lip = height - 0.015
    profile = [(0, 0), (radius, 0), (radius, lip - 0.01), (lid * radius, lip), (lid * radius, height), (0, height)]
    return turned("jar", profile, top=0.9 * lid * radius)


def _oval_tin(rng: np.random.Generator) -> Shape:
    long, wide = rng.uniform(0.07, 0.12), rng.uniform(0.045, 0.065)
    angles = np.linspace(0.0, 2 * math.pi, SIDES, endpoint=False)
    outline = shapely.Polygon(np.column_stack((long / 2 * np.cos(angles), wide / 2 * np.sin(angles))))
    return standing("oval tin", trimesh.creation.extrude_polygon(outline, rng.uniform(0.03, 0.11)), wide / 2)


def _hexagon_box(rng: np.random.Generator) -> Shape:
    radius = rng.uniform(0.035, 0.07)
    mesh = trimesh.creation.cylinder(radius, rng.uniform(0.04, 0.15), sections=6)
    return standing("hexagon box", mesh, 0.85 * radius)


def _pan(rng: np.random.Generator) -> Shape:
    radius, height = rng.uniform(0.07, 0.1), rng.uniform(0.05, 0.09)
    grips = [trimesh.creation.box((0.03, 0.05, 0.012)) for _ in range(2)]
    for way, grip in zip((-1, 1), grips, strict=True):
        grip.apply_translation((way * (radius + 0.012), 0.0, 0.8 * height))
    return hollow("pan", [(0.95 * radius, 0.0), (radius, 0.01), (radius, height)], *grips)


def _goblet(rng: np.random.Generator) -> Shape:
    radius, height = rng.uniform(0.034, 0.045), rng.uniform(0.08, 0.13)
    return hollow("beaker", [(0.8 * radius, 0.0), (0.72 * radius, 0.4 * height), (radius, height)])


def _lying_bar(rng: np.random.Generator) -> Shape:
    mesh = trimesh.creation.cylinder(rng.uniform(0.022, 0.04), rng.uniform(0.1, 0.22), sections=8)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 8, (0, 0, 1)))
    mesh.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 2, (0, 1, 0)))
    return standing("bar", mesh, 0.0)


def _saucer(rng: np.random.Generator) -> Shape:
    radius = rng.uniform(0.075, 0.13)
    return hollow("tray", [(0.85 * radius, 0.0), (0.9 * radius, 0.003), (radius, rng.uniform(0.018, 0.03))])


def _pear(rng: np.random.Generator) -> Shape:
    radius, height = rng.uniform(0.025, 0.04), rng.uniform(0.06, 0.1)
    angles = np.linspace(0.0, math.pi, 14)
    profile = [
        (radius * math.sin(a) * (1.0 - 0.35 * (1 - math.cos(a)) / 2), height * (1 - math.cos(a)) / 2) for a in angles
    ]
    profile[0], profile[-1] = (0.0, 0.0), (0.0, height)
    return turned("pear", profile)


@dataclass(frozen=True)
class Family:
    """The objects of one part of the synthetic tables.

    Attributes:
        boxes: objects with upright sides that others touch and stand on.
        any: every object that stands by itself.
        hollow: those that hold others.
        small: those that fit into them.
        tall: those that hide others.
        flat: those of less than a centimetre.
    """

    boxes: Sequence[Draw]
    any: Sequence[Draw]
    hollow: Sequence[Draw]
    small: Sequence[Draw]
    tall: Sequence[Draw]
    flat: Sequence[Draw]


PARTS = {
    "development": Family(
        boxes=(_box, _flat_box, _box, _tin),
        any=(_box, _box, _flat_box, _tin, _lying_roll, _bowl, _cup, _mug, _plate, _ball),
        hollow=(_bowl, _plate),
        small=(_ball, _cup, _mug, _ball),
        tall=(_box, _tin, _mug),
        flat=(_knife, _booklet, _disc),
    ),
    "test": Family(
        boxes=(_rounded_box, _rounded_box, _hexagon_box, _oval_tin, _jar),
        any=(_rounded_box, _gable, _bottle, _jar, _oval_tin, _hexagon_box, _lying_bar, _pan, _goblet, _saucer, _pear),
        hollow=(_pan, _saucer),
        small=(_pear, _goblet, _pear),
        tall=(_gable, _bottle, _jar, _rounded_box),
        flat=(_ruler, _hexagon_mat),
    ),
}


def standing(kind: str, mesh: trimesh.Trimesh, top: float) -> Shape:
    mesh.apply_translation((0.0, 0.0, -mesh.bounds[0, 2]))
    return Shape(kind, mesh, top)


def turned(kind: str, profile: Sequence[tuple[float, float]], top: float = 0.0) -> Shape:
    return Shape(kind, trimesh.creation.revolve(np.array(profile), sections=SIDES), top)


def hollow(kind: str, outer: Sequence[tuple[float, float]], *extra: trimesh.Trimesh) -> Shape:
    """Return a vessel with the outer (radius, z) profile, from the bottom up, and further parts such as a handle."""
    inner = [(radius - _WALL, max(z, _WALL)) for radius, z in reversed(outer)]
    inner[0] = (inner[0][0], outer[-1][1])
    mesh = trimesh.creation.revolve(np.array([(0.0, 0.0), *outer, *inner, (0.0, _WALL)]), sections=SIDES)
    whole = trimesh.util.concatenate([mesh, *extra])
    assert isinstance(whole, trimesh.Trimesh)
    return Shape(kind, whole, floor=(_WALL, inner[-1][0]))


def placed_footprint(shape: Shape, pose: np.ndarray) -> shapely.Polygon:
    """Return the outline, seen from above, of a shape at a pose (4, 4)."""
    corners = np.array(shape.footprint.exterior.coords)
    return shapely.Polygon(transform_points(pose, np.column_stack((corners, np.zeros(len(corners)))))[:, :2])
