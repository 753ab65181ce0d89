"""Read mesh files as objects in metres, z up: one per file, or those that stand apart in it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from structdiffusion.limits import MESH_BYTES, MESH_FACES, MESH_NODES
from structdiffusion.objects import gltf
from structdiffusion.objects.gltf import OwnFolder, gltf_faces
from structdiffusion.objects.model import ObjectError

# m: parts whose boxes are closer belong to one object. A lid lies nearer to its pot, and objects that somebody laid
# out side by side do not.
APART = 0.005
# The standard of glTF has y up.
_Z_UP_FROM_Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


@dataclass(frozen=True)
class MeshPart:
    """A surface in metres, z up, as it stands in its file.

    Attributes:
        names: of the nodes that it is made of.
        mesh: the surface.
    """

    names: tuple[str, ...]
    mesh: trimesh.Trimesh

    @property
    def name(self) -> str:
        """Return the first of its names."""
        return self.names[0]


def read_parts(path: Path) -> list[MeshPart]:
    """Read the objects of a mesh file: nodes of glTF and objects of .obj that stand apart.

    Raises:
        ObjectError: for a file that cannot be used; the message says why.
    """
    if (size := path.stat().st_size) > MESH_BYTES:
        raise ObjectError(f"the mesh {str(path)!r} has {size} bytes; at most {MESH_BYTES} are read: simplify it")
    # Readers of broken files raise almost any exception (struct, index, key, json, unicode errors).
    try:
        if path.suffix.lower() in gltf.FORMATS:
            _check_faces(path, gltf_faces(path))  # a file of a kilobyte can place a mesh a million times
        parts = _parts_of(path)
    except ObjectError:
        raise
    except Exception as error:
        raise ObjectError(f"the mesh {str(path)!r} cannot be read: {reason(error)}") from error
    if not parts:
        raise ObjectError(f"the mesh {str(path)!r} cannot be used: it has no faces")
    _check_faces(path, sum(len(part.mesh.faces) for part in parts))
    if not all(np.isfinite(part.mesh.vertices).all() for part in parts):
        raise ObjectError(f"the mesh {str(path)!r} cannot be used: some of its coordinates are not numbers")
    return _objects(parts)


def _parts_of(path: Path) -> list[MeshPart]:
    """Return the named surfaces of a file where they stand in it, without materials, which name further files."""
    suffix = path.suffix.lower()
    options: dict[str, Any] = {"resolver": OwnFolder(path), "process": False, "skip_materials": True}
    if suffix == ".obj":
        options |= {"split_objects": True, "group_material": False}
    with path.open("rb") as file:
        loaded = trimesh.load_scene(file, file_type=suffix[1:], **options)
    surfaces: dict[tuple[str, str], list[trimesh.Trimesh]] = {}
    for node in loaded.graph.nodes_geometry:
        pose, geometry = loaded.graph[node]
        surface = loaded.geometry[geometry]
        if not isinstance(surface, trimesh.Trimesh) or not len(surface.faces):
            continue
        # The materials of one mesh are nodes below that of the mesh.
        one_of_several = surface.metadata.get("from_gltf_primitive")
        owner = str(loaded.graph.transforms.parents[node] if one_of_several else node)
        surface = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
        surface.apply_transform(_Z_UP_FROM_Y_UP @ pose if suffix in gltf.FORMATS else pose)
        # A node without a name has a number, and its mesh may have a name.
        surfaces.setdefault((str(geometry) if owner.isdigit() else owner, owner), []).append(surface)
    if len(surfaces) > MESH_NODES:
        raise ValueError(f"it has {len(surfaces)} parts; at most {MESH_NODES} are read")
    taken: set[str] = set()
    # In the order of the names: that of the nodes is not the same in every run.
    return [MeshPart((_free(key[0], taken),), _one(surfaces[key])) for key in sorted(surfaces)]


def _free(name: str, taken: set[str]) -> str:
    """Make a name that can be the end of a path and differs from those that are taken."""
    plain = re.sub(r"[^\w .()+-]+", "_", name).strip(" .")[:60] or "part"
    free, number = plain, 2
    while free in taken:
        free, number = f"{plain} {number}", number + 1
    taken.add(free)
    return free


def _one(surfaces: Sequence[trimesh.Trimesh]) -> trimesh.Trimesh:
    joined = surfaces[0] if len(surfaces) == 1 else trimesh.util.concatenate(list(surfaces))
    assert isinstance(joined, trimesh.Trimesh)
    return joined


def _objects(parts: Sequence[MeshPart]) -> list[MeshPart]:
    """Unite the parts that touch each other."""
    if len(parts) == 1:
        return list(parts)
    united = []
    for group in _touching(np.stack([part.mesh.bounds for part in parts])):
        members = [parts[i] for i in group]
        names = tuple(name for part in members for name in part.names)
        united.append(MeshPart(names, _one([part.mesh for part in members])))
    return united


def _touching(boxes: np.ndarray) -> list[list[int]]:
    """Return groups of indices of boxes (N, 2, 3) that are less than `APART` from each other, in order."""
    group = np.arange(len(boxes))
    for i, (low, high) in enumerate(boxes):
        near = (np.maximum(boxes[:, 0] - high, low - boxes[:, 1]) < APART).all(axis=1)
        joined = np.isin(group, group[near | (np.arange(len(boxes)) == i)])
        group[joined] = group[joined].min()
    return [np.flatnonzero(group == each).tolist() for each in np.unique(group)]


def loose_pieces(mesh: trimesh.Trimesh) -> int:
    """Count the pieces of a surface that stand apart, as objects in one file do; specks of a scan are none."""
    merged = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)
    connected = trimesh.graph.connected_components(
        merged.face_adjacency, nodes=np.arange(len(merged.faces)), min_len=4, engine="scipy"
    )
    areas, least = merged.area_faces, 0.02 * merged.area
    kept = [merged.triangles[faces].reshape(-1, 3) for faces in connected if areas[faces].sum() > least]
    return len(_touching(np.stack([[points.min(axis=0), points.max(axis=0)] for points in kept]))) if kept else 0


def reason(error: Exception) -> str:
    """Return the first line of an error's message, or that it is damaged where it has none."""
    lines = str(error).strip().splitlines()
    return lines[0] if lines else f"it is damaged ({type(error).__name__})"


def _check_faces(path: Path, faces: int) -> None:
    if faces > MESH_FACES:
        raise ObjectError(f"the mesh {str(path)!r} has {faces} faces; at most {MESH_FACES} are read: simplify it")
