"""Prepare objects from mesh files: read, check, simplify, decompose."""

from __future__ import annotations

import hashlib
import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh

from structdiffusion.limits import MESH_FINE_FACES
from structdiffusion.objects.file_nouns import category_of
from structdiffusion.objects.mesh_files import MeshPart, loose_pieces, read_parts, reason
from structdiffusion.objects.meshes import ObjectProperties, coarser, object_from_mesh
from structdiffusion.objects.model import ObjectError, ObjectModel

SMALLEST, LARGEST = 0.005, 0.5
# Kilograms per cubic metre of hull: most household objects are hollow or light.
_DENSITY = 400.0
_FRICTION = 0.5
_log = logging.getLogger("structagent")  # shows warnings on standard error


def prepare(path: Path, name: str, category: str | None = None) -> list[ObjectModel]:
    """Prepare the objects of a mesh file in this process, without a time limit.

    Args:
        path: a file of one of `FORMATS`, in metres.
        name: of the file; of several objects each has the name of its node. Its colour follows from it.
        category: its noun; by default that in its own name, the file's or the folder's.

    Raises:
        ObjectError: if a mesh cannot be used; the message says why.
    """
    parts = read_parts(path)
    inside = (path.stem, *reversed(Path(name).parts[:-1]))
    if len(parts) == 1:
        _tell_what_is_one(path, parts[0])
        return [_prepared(path, repr(str(path)), parts[0].mesh, name, category or category_of(*inside))]
    models = []
    for part in parts:
        _tell_what_is_one(path, part)
        noun = category or category_of(part.name, *inside)
        model = _prepared(path / part.name, f"{str(path)!r}, node {part.name!r},", part.mesh, part.name, noun)
        models.append(model)
    return models


def _tell_what_is_one(path: Path, part: MeshPart) -> None:
    """Warn of what is taken for one object and may be several."""
    if len(part.names) > 1:
        several = ", ".join(part.names[:4]) + (f" and {len(part.names) - 4} more" if len(part.names) > 4 else "")
        what = f"the nodes {several} touch"
    elif (pieces := loose_pieces(part.mesh)) > 1:
        what = f"{pieces} pieces stand apart without names"
    else:
        return
    _log.warning(
        "in %r, %s, and are one object here: if they are several, save each in a file of its own", str(path), what
    )


def _prepared(path: Path, where: str, mesh: trimesh.Trimesh, name: str, category: str) -> ObjectModel:
    size = float(mesh.extents.max())
    if not SMALLEST <= size <= LARGEST:
        millimetres = SMALLEST <= size / 1000 <= LARGEST
        raise ObjectError(
            f"the mesh {where} is {size:.4g} m long: the unit must be metres, "
            f"and objects between {SMALLEST} and {LARGEST} m"
            + ("; if its unit is the millimetre, scale it by 0.001" if millimetres else "")
        )
    mesh = coarser(mesh, MESH_FINE_FACES)
    # The colour depends on the name alone, so it is the same in every run.
    hue = hashlib.sha256(name.encode()).digest()
    try:
        properties = ObjectProperties(
            name=name,
            category=category,
            source="folder",
            mass=float(np.clip(_DENSITY * mesh.convex_hull.volume, 0.005, 2.0)),
            friction=_FRICTION,
            color=(0.25 + hue[0] / 425, 0.25 + hue[1] / 425, 0.25 + hue[2] / 425),
        )
        return replace(object_from_mesh(mesh, properties), file=path)
    except (ValueError, RuntimeError, ArithmeticError) as error:  # Qhull's errors are RuntimeErrors
        message = f"the mesh {where} cannot be used: it does not enclose a volume ({reason(error)})"
        raise ObjectError(message) from error
