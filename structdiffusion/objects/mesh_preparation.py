"""Prepare objects from mesh files: read, check, simplify, decompose."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import trimesh

from structdiffusion.limits import MESH_BYTES, MESH_FACES, MESH_FINE_FACES, glb_faces
from structdiffusion.objects.meshes import ObjectProperties, coarser, object_from_mesh
from structdiffusion.objects.model import ObjectError, ObjectModel

SMALLEST, LARGEST = 0.005, 0.5
# Kilograms per cubic metre of hull: most household objects are hollow or light.
_DENSITY = 400.0
_FRICTION = 0.5


def prepare(path: Path, name: str, category: str) -> ObjectModel:
    """Prepare the object of a mesh file in this process, without a time limit.

    Args:
        path: a .obj, .stl, .ply or .glb file in metres, z up.
        name: its name; its colour follows from it.
        category: its noun.

    Raises:
        ObjectError: if the mesh cannot be used; the message says why.
    """
    mesh = _read(path)
    size = float(mesh.extents.max())
    if not SMALLEST <= size <= LARGEST:
        raise ObjectError(
            f"the mesh {str(path)!r} is {size:.4g} m long: the unit must be metres, "
            f"and objects between {SMALLEST} and {LARGEST} m"
        )
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
        return object_from_mesh(mesh, properties)
    except (ValueError, RuntimeError, ArithmeticError) as error:  # Qhull's errors are RuntimeErrors
        message = f"the mesh {str(path)!r} cannot be used: it does not enclose a volume ({_reason(error)})"
        raise ObjectError(message) from error


def _reason(error: Exception) -> str:
    """Return the first line of an error's message, or the error's name if it has no message."""
    lines = str(error).strip().splitlines()
    return lines[0] if lines else type(error).__name__


def _read(path: Path) -> trimesh.Trimesh:
    if (size := path.stat().st_size) > MESH_BYTES:
        raise ObjectError(f"the mesh {str(path)!r} has {size} bytes; at most {MESH_BYTES} are read: simplify it")
    # Readers of broken files raise almost any exception (struct, index, key, json, unicode errors).
    try:
        if path.suffix.lower() == ".glb":
            _check_faces(path, glb_faces(path))  # before loading: a file of a kilobyte can place a mesh a million times
        mesh = trimesh.load(path, force="mesh", process=False)
    except ObjectError:
        raise
    except Exception as error:
        raise ObjectError(f"the mesh {str(path)!r} cannot be read: {_reason(error)}") from error
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise ObjectError(f"the mesh {str(path)!r} cannot be used: it has no faces")
    _check_faces(path, len(mesh.faces))
    if not np.isfinite(mesh.vertices).all():
        raise ObjectError(f"the mesh {str(path)!r} cannot be used: some of its coordinates are not numbers")
    return coarser(mesh, MESH_FINE_FACES)


def _check_faces(path: Path, faces: int) -> None:
    if faces > MESH_FACES:
        raise ObjectError(f"the mesh {str(path)!r} has {faces} faces; at most {MESH_FACES} are read: simplify it")
