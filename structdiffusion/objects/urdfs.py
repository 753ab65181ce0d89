"""Load PyBullet's random_urdfs: 1000 random blocky bodies, which complement the procedural training objects."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np

from structdiffusion.objects.model import ObjectError, ObjectModel

AVAILABLE = 1000
# m: longer bodies do not fit between other objects on the table.
_LARGEST = 0.16
_FRICTION = 0.5


def random_urdfs_objects(count: int = 200, first: int = 0) -> list[ObjectModel]:
    """Return `count` usable bodies, scaled as their URDF says; their category is "object".

    Each is a union of a few convex pieces, which are its parts, in a pose of rest. Bodies longer than 16 cm, or with
    coordinates that are not numbers (168), are omitted.

    Args:
        count: how many.
        first: how many usable ones come before them.

    Raises:
        ObjectError: if `count` is not between 1 and 1000, or there are fewer usable bodies.
    """
    if not 1 <= count <= AVAILABLE:
        raise ObjectError(f"count must be between 1 and {AVAILABLE}, got {count}")
    import pybullet_data

    root = Path(pybullet_data.getDataPath()) / "random_urdfs"
    models: list[ObjectModel] = []
    for folder in sorted(root.iterdir()):
        if len(models) == first + count:
            break
        if (urdf := folder / f"{folder.name}.urdf").is_file() and (model := _object(urdf)) is not None:
            models.append(model)
    if len(models) < first + count:
        raise ObjectError(f"PyBullet's random_urdfs hold {len(models)} usable bodies, {first + count} were asked for")
    return models[first:]


def _object(urdf: Path) -> ObjectModel | None:
    import trimesh  # not above: the table of libraries names this one, and most runs take another

    from structdiffusion.objects.meshes import ObjectProperties, object_from_mesh

    root = ElementTree.parse(urdf).getroot()
    mesh: Any = trimesh.load(
        urdf.parent / _value(root, "collision/geometry/mesh", "filename"), force="mesh", process=False
    )
    mesh.apply_scale(np.array(_value(root, "collision/geometry/mesh", "scale").split(), dtype=float))
    if not np.isfinite(mesh.vertices).all() or mesh.extents.max() > _LARGEST:
        return None
    red, green, blue, *_ = (float(value) for value in _value(root, "visual/material/color", "rgba").split())
    properties = ObjectProperties(
        name=f"random_{urdf.stem}",
        category="object",
        source="random_urdfs",
        mass=float(_value(root, "inertial/mass", "value")),
        friction=_FRICTION,
        color=(red, green, blue),
    )
    return object_from_mesh(mesh, properties, settle_within=math.pi)  # they have no upright pose of their own


def _value(root: ElementTree.Element, path: str, key: str) -> str:
    """Return what the first link of a body says of one of its parts."""
    part = root.find(f"link/{path}")
    value = None if part is None else part.get(key)
    assert value is not None  # PyBullet's files are all alike
    return value
