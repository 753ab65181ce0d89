"""Draw the objects of training tables: the development objects, the procedural ones, and bodies of random outlines.

The objects of the test part and the scans are not among them.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
import trimesh

from agent.synthetic_tables.shapes import PARTS, SIDES, Family, Shape, hollow, standing, turned
from structdiffusion.objects.procedural import KINDS

_DEVELOPMENT = PARTS["development"]
_PROCEDURAL = tuple(KINDS)


def _any_box(rng: np.random.Generator) -> Shape:
    """Draw a box between a die and a parcel."""
    sides = np.exp(rng.uniform(math.log(0.025), math.log(0.3), 3))
    sides[2] = min(sides[2], 0.3)
    sides[:2] = np.minimum(sides[:2], 0.28)
    return standing("box", trimesh.creation.box(sides), float(min(sides[:2])) / 2)


def _thin_box(rng: np.random.Generator) -> Shape:
    long, wide = rng.uniform(0.08, 0.28), rng.uniform(0.06, 0.2)
    return standing("box", trimesh.creation.box((long, wide, rng.uniform(0.012, 0.035))), min(long, wide) / 2)


def _upright_box(rng: np.random.Generator) -> Shape:
    long, thick = rng.uniform(0.08, 0.22), rng.uniform(0.025, 0.07)
    return standing("box", trimesh.creation.box((long, thick, rng.uniform(0.12, 0.3))), thick / 2)


def _prism(rng: np.random.Generator) -> Shape:
    """Draw an upright body over a random convex outline; its edges are rounded in half of the cases."""
    reach = rng.uniform(0.03, 0.1)
    outline = shapely.MultiPoint(reach * rng.uniform(-1.0, 1.0, (int(rng.integers(4, 9)), 2))).convex_hull
    outline = outline.buffer(rng.uniform(0.005, 0.03), quad_segs=4 if rng.random() < 0.5 else 1)
    outline = shapely.affinity.translate(outline, -outline.centroid.x, -outline.centroid.y)
    inner = outline.exterior.distance(shapely.Point(0.0, 0.0))
    return standing("prism", trimesh.creation.extrude_polygon(outline, rng.uniform(0.03, 0.2)), inner)


def _turned_body(rng: np.random.Generator) -> Shape:
    """Draw a solid of revolution of a random profile: vases, bottles, lamps, spools."""
    height, knots = rng.uniform(0.04, 0.26), int(rng.integers(2, 6))
    radii = np.clip(rng.uniform(0.02, 0.06) * np.exp(rng.normal(0.0, 0.3, knots)), 0.01, 0.11)
    levels = np.sort(np.concatenate(([0.0, height], rng.uniform(0.0, height, knots - 2))))
    if rng.random() < 0.5:  # smooth instead of angular
        fine = np.linspace(0.0, height, 14)
        radii, levels = np.interp(fine, levels, radii), fine
        radii = np.convolve(np.pad(radii, 2, mode="edge"), np.ones(5) / 5, mode="valid")
    profile = [(0.0, 0.0), *zip(radii, levels, strict=True), (0.0, height)]
    return turned("turned body", profile, top=0.9 * float(radii[-1]))


def _lying_body(rng: np.random.Generator) -> Shape:
    """Draw a round or angular body that lies on its side."""
    mesh = _turned_body(rng).mesh if rng.random() < 0.5 else trimesh.creation.cylinder(
        rng.uniform(0.012, 0.05), rng.uniform(0.06, 0.28), sections=int(rng.choice((3, 6, SIDES)))
    )  # fmt: skip
    mesh = mesh.copy()
    mesh.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 2, (0, 1, 0)))
    mesh.apply_transform(trimesh.transformations.rotation_matrix(rng.uniform(0.0, math.pi), (1, 0, 0)))
    mesh.apply_translation((*-mesh.bounds[:, :2].mean(axis=0), 0.0))
    return standing("lying body", mesh, 0.0)


def _tin(rng: np.random.Generator) -> Shape:
    radius, height = rng.uniform(0.02, 0.08), rng.uniform(0.03, 0.22)
    profile = [(0, 0), (radius, 0), (rng.uniform(0.8, 1.1) * radius, height), (0, height)]
    return turned("tin", profile, top=0.8 * radius)


def _vessel(rng: np.random.Generator) -> Shape:
    """Draw a hollow body of any width and height, with a handle, two, or none."""
    radius, height = rng.uniform(0.03, 0.13), rng.uniform(0.025, 0.14)
    foot, bulge = rng.uniform(0.5, 1.0), rng.uniform(0.6, 1.6)
    share = np.linspace(0.0, 1.0, int(rng.integers(2, 8)))
    outer = [(radius * (foot + (1.0 - foot) * s**bulge), height * s) for s in share]
    return hollow("vessel", outer, *_handles(rng, radius, height))


def _handles(rng: np.random.Generator, radius: float, height: float) -> list[trimesh.Trimesh]:
    kind = rng.random()
    if kind < 0.5 or height < 0.04:
        return []
    if kind < 0.8:
        ring = trimesh.creation.torus(rng.uniform(0.25, 0.35) * height, rng.uniform(0.004, 0.008), SIDES, 8)
        ring.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 2, (1, 0, 0)))
        ring.apply_translation((radius + 0.005, 0.0, height / 2))
        ring.update_faces(np.linalg.norm(ring.triangles_center[:, :2], axis=1) > radius)
        return [ring]
    long = rng.uniform(0.02, 0.14)
    bar = trimesh.creation.box((long, rng.uniform(0.012, 0.03), rng.uniform(0.008, 0.02)))
    bar.apply_translation((radius + 0.48 * long, 0.0, rng.uniform(0.6, 0.9) * height))
    return [bar]


def _stone(rng: np.random.Generator) -> Shape:
    """Draw a convex body without any plane or axis: fruit, stones, toys."""
    points = rng.standard_normal((24, 3))
    points *= rng.uniform(0.02, 0.07, 3) / np.linalg.norm(points, axis=1, keepdims=True)
    mesh = trimesh.convex.convex_hull(points)
    if rng.random() < 0.5:
        mesh = trimesh.creation.icosphere(3, 1.0)
        mesh.apply_scale(rng.uniform(0.02, 0.055, 3))
    return standing("stone", mesh, 0.0)


def _procedural(rng: np.random.Generator) -> Shape:
    """Draw one of the procedural objects that the pose generators are trained with."""
    build, _, _ = KINDS[_PROCEDURAL[int(rng.integers(len(_PROCEDURAL)))]]
    mesh = trimesh.util.concatenate([trimesh.convex.convex_hull(part) for part in build(rng)])
    assert isinstance(mesh, trimesh.Trimesh)
    mesh.apply_translation((*-mesh.bounds[:, :2].mean(axis=0), 0.0))
    return standing("procedural", mesh, 0.0)


TRAINING = Family(
    boxes=(*_DEVELOPMENT.boxes, _any_box, _any_box, _any_box, _thin_box, _upright_box, _prism, _tin),
    any=(
        *_DEVELOPMENT.any, _any_box, _any_box, _any_box, _thin_box, _upright_box, _prism, _prism, _turned_body,
        _turned_body, _lying_body, _lying_body, _tin, _tin, _vessel, _vessel, _stone, _stone, *(_procedural,) * 6,
    ),
    hollow=(*_DEVELOPMENT.hollow, _vessel, _vessel, _vessel),
    small=(*_DEVELOPMENT.small, _stone, _stone, _any_box, _tin, _turned_body),
    tall=(*_DEVELOPMENT.tall, _upright_box, _turned_body, _prism),
    flat=_DEVELOPMENT.flat,
)  # fmt: skip
