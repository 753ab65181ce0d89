"""Draw shapes with known nouns, and what cameras measure of them: the examples that the shape head learns from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pybullet_data
import trimesh

from agent.evaluation.nouns.object_views import Surface, object_view
from agent.perception.nouns.shape_features import COUNT, shape_features
from agent.synthetic_tables.shapes import PARTS
from structdiffusion.objects.model import ObjectModel
from structdiffusion.objects.procedural import KINDS, procedural_object

OTHER = "other"
_SIDES = 32
_RAMEKINS = 0.25  # share of bowls that are small and have upright walls
_KINDS = {"book": "box", "spatula": "long", "fork": "long", "knife": "long", "spoon": "long", "candle": OTHER}
_FAMILIES = {
    "tin": "can", "carton": "box", "case": "box", "beaker": "cup", "roll": OTHER, "oval tin": OTHER, "pear": OTHER,
    "hexagon box": OTHER, "bar": OTHER, "tray": OTHER,
}  # fmt: skip
Draw = Callable[[np.random.Generator], tuple[str, trimesh.Trimesh]]


def shape_examples(count: int, seed: int | tuple[int, ...]) -> tuple[np.ndarray, list[str]]:
    """Return the features (count, F) of drawn shapes as cameras see them, and the class of each."""
    rng = np.random.default_rng(seed)
    sources: Sequence[Draw] = (_procedural, _family, _turned, _stray)
    features = np.empty((count, COUNT), np.float32)
    classes: list[str] = []
    while len(classes) < count:
        name, mesh = sources[int(rng.choice(4, p=(0.4, 0.2, 0.25, 0.15)))](rng)
        view = object_view([Surface(mesh)], rng, picture=False)
        if view is not None:
            features[len(classes)] = shape_features(view.points, view.eye)
            classes.append(name)
    return features, classes


def _mesh(model: ObjectModel) -> trimesh.Trimesh:
    return trimesh.Trimesh(model.mesh_vertices, model.mesh_faces, process=False)


def _procedural(rng: np.random.Generator) -> tuple[str, trimesh.Trimesh]:
    kind = str(rng.choice(list(KINDS)))
    return _KINDS.get(kind, kind), _mesh(procedural_object(kind, int(rng.integers(1_000_000)), seed=1))


def _family(rng: np.random.Generator) -> tuple[str, trimesh.Trimesh]:
    draws = PARTS[str(rng.choice(list(PARTS)))].any
    shape = draws[int(rng.integers(len(draws)))](rng)
    return _FAMILIES.get(shape.kind, shape.kind), shape.mesh


@lru_cache(maxsize=1)
def _strays() -> list[Path]:
    return sorted((Path(pybullet_data.getDataPath()) / "random_urdfs").glob("*/*.obj"))


def _stray(rng: np.random.Generator) -> tuple[str, trimesh.Trimesh]:
    """Return an object without a noun: one of PyBullet's random ones, or two shapes pushed together."""
    if rng.random() < 0.6:
        files = _strays()
        mesh: Any = trimesh.load(files[int(rng.integers(len(files)))], force="mesh", process=False)
        if not np.isfinite(mesh.vertices).all():
            return _stray(rng)  # one of the files holds no numbers
        return OTHER, mesh.apply_scale(rng.uniform(0.05, 0.16) / mesh.extents.max())
    first, second = (_family(rng)[1].copy() for _ in range(2))
    second.apply_translation((*rng.uniform(-0.04, 0.04, 2), rng.choice((0.0, rng.uniform(0.0, 0.08)))))
    return OTHER, _joined(first, second)


def _revolved(profile: Sequence[tuple[float, float]]) -> trimesh.Trimesh:
    return trimesh.creation.revolve(np.array(profile), sections=_SIDES)


def _turned(rng: np.random.Generator) -> tuple[str, trimesh.Trimesh]:
    """Return a shape as potters and packers make them: curved walls, rims, caps, lids and roofs."""
    names = ("mug", "cup", "bowl", "can", "bottle", "plate", "jar", "ball", "pitcher", "box")
    name = str(rng.choice(names, p=(0.17, 0.12, 0.16, 0.14, 0.17, 0.08, 0.04, 0.04, 0.04, 0.04)))
    return name, _TURNED[name](rng)


def _vessel(radius: float, height: float, foot: float, belly: float, wall: float) -> trimesh.Trimesh:
    """Return a hollow body: the foot's radius as a share of the rim's, and how round the wall between them is."""
    rise = np.linspace(0.0, 1.0, 8)
    outer = radius * (foot + (1 - foot) * rise**belly)
    inner = np.maximum(outer - wall, 0.002)
    profile = [(0.0, 0.0), *zip(outer, height * rise, strict=True)]
    profile += list(zip(inner[::-1], np.maximum(height * rise[::-1], wall), strict=True)) + [(0.0, wall)]
    return _revolved(profile)


def _handle(radius: float, height: float, rng: np.random.Generator) -> trimesh.Trimesh:
    ring = trimesh.creation.torus(1.0, rng.uniform(0.12, 0.22), major_sections=24, minor_sections=8)
    ring.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
    tall = height * rng.uniform(0.24, 0.36)
    ring.apply_scale((rng.uniform(0.7, 1.0) * min(tall, 0.03), 0.03, tall))
    ring.apply_translation((radius + 0.004, 0.0, height * rng.uniform(0.45, 0.6)))
    ring.update_faces(np.linalg.norm(ring.triangles_center[:, :2], axis=1) > radius - 0.002)
    return ring


def _joined(*parts: trimesh.Trimesh) -> trimesh.Trimesh:
    joined = trimesh.util.concatenate(list(parts))
    assert isinstance(joined, trimesh.Trimesh)
    return joined


def _mug(rng: np.random.Generator) -> trimesh.Trimesh:
    radius, height = rng.uniform(0.036, 0.055), rng.uniform(0.07, 0.13)
    body = _vessel(radius, height, rng.uniform(0.65, 1.0), rng.uniform(0.3, 1.2), rng.uniform(0.003, 0.006))
    return _joined(body, _handle(radius * 0.93, height, rng))


def _cup(rng: np.random.Generator) -> trimesh.Trimesh:
    radius = rng.uniform(0.028, 0.05)
    height = radius * rng.uniform(1.4, 2.8)
    return _vessel(radius, height, rng.uniform(0.6, 1.0), rng.uniform(0.3, 1.2), rng.uniform(0.002, 0.005))


def _bowl(rng: np.random.Generator) -> trimesh.Trimesh:
    if rng.random() < _RAMEKINS:
        radius = rng.uniform(0.035, 0.06)
        return _vessel(radius, radius * rng.uniform(0.6, 1.1), rng.uniform(0.8, 1.0), 1.0, rng.uniform(0.003, 0.006))
    radius = rng.uniform(0.055, 0.11)
    height = radius * rng.uniform(0.5, 1.0)
    return _vessel(radius, height, rng.uniform(0.3, 0.7), rng.uniform(0.3, 1.0), rng.uniform(0.003, 0.006))


def _plate(rng: np.random.Generator) -> trimesh.Trimesh:
    radius = rng.uniform(0.08, 0.14)
    return _vessel(radius, rng.uniform(0.012, 0.032), rng.uniform(0.5, 0.75), rng.uniform(0.6, 1.5), 0.004)


def _can(rng: np.random.Generator) -> trimesh.Trimesh:
    radius, height, lip = rng.uniform(0.025, 0.055), rng.uniform(0.03, 0.17), rng.uniform(0.001, 0.004)
    neck = radius * rng.choice((1.0, 1.0, rng.uniform(0.78, 0.95)))  # drink cans are drawn in
    return _revolved([
        (0, 0), (neck, 0), (radius, 0.006), (radius, height - 0.012), (neck, height), (neck - 0.003, height),
        (neck - 0.003, height - lip), (0, height - lip),
    ])  # fmt: skip


def _bottle(rng: np.random.Generator) -> trimesh.Trimesh:
    radius, height = rng.uniform(0.024, 0.05), rng.uniform(0.11, 0.29)
    neck, cap = rng.uniform(0.25, 0.55) * radius, rng.uniform(0.012, 0.04)
    shoulder = rng.uniform(0.45, 0.78) * height
    rise = np.linspace(0.0, 1.0, 6)
    curve = radius + (neck - radius) * rise ** rng.uniform(0.7, 2.2)
    top = max(height - cap, shoulder + 0.01)
    cone = [(float(r), float(shoulder + (top - shoulder) * s)) for r, s in zip(curve, rise, strict=True)]
    lid = neck * rng.uniform(0.9, 1.3)
    tip = lid * rng.choice((1.0, rng.uniform(0.2, 0.6)))
    mesh = _revolved([(0, 0), (radius * 0.9, 0), (radius, 0.008), *cone, (lid, top), (tip, height), (0, height)])
    mesh.apply_scale((1.0, rng.choice((1.0, rng.uniform(0.5, 0.8))), 1.0))  # squeezed ones are flat
    return mesh


def _jar(rng: np.random.Generator) -> trimesh.Trimesh:
    radius, height = rng.uniform(0.03, 0.05), rng.uniform(0.05, 0.15)
    lid, rim = radius * rng.uniform(0.7, 0.98), rng.uniform(0.7, 0.85) * height
    return _revolved([(0, 0), (radius, 0.0), (radius, 0.9 * rim), (lid, rim), (lid, height), (0, height)])


def _ball(rng: np.random.Generator) -> trimesh.Trimesh:
    mesh = trimesh.creation.icosphere(3, rng.uniform(0.02, 0.05))
    mesh.apply_scale(rng.uniform(0.93, 1.07, 3))
    return mesh


def _pitcher(rng: np.random.Generator) -> trimesh.Trimesh:
    radius, height = rng.uniform(0.045, 0.07), rng.uniform(0.14, 0.24)
    body = _vessel(radius, height, rng.uniform(0.75, 1.1), 1.0, 0.004)
    return _joined(body, _handle(radius * 0.95, height, rng))


def _milk_carton(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a carton with a roof, the ridge of which is a seam."""
    length, width, wall = rng.uniform(0.045, 0.1), rng.uniform(0.045, 0.1), rng.uniform(0.08, 0.2)
    roof, seam, cut = rng.uniform(0.3, 0.6) * width, rng.uniform(0.008, 0.02), rng.uniform(0.0, 0.4) * length
    corners = np.array([(x, y, z) for x in (-length, length) for y in (-width, width) for z in (0.0, 2 * wall)]) / 2
    ridge = np.array([(x, y, wall + roof) for x in (cut - length, length - cut) for y in (-0.004, 0.004)]) / (2, 2, 1)
    fin = trimesh.creation.box((length, 0.004, seam))
    fin.apply_translation((0.0, 0.0, wall + roof + seam / 2))
    return _joined(trimesh.convex.convex_hull(np.concatenate((corners, ridge))), fin)


_TURNED = {
    "mug": _mug, "cup": _cup, "bowl": _bowl, "can": _can, "bottle": _bottle, "plate": _plate, "jar": _jar,
    "ball": _ball, "pitcher": _pitcher, "box": _milk_carton,
}  # fmt: skip
