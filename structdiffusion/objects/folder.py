"""Load objects from a folder of the user's own meshes and its subfolders, in metres."""

from __future__ import annotations

import logging
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from structdiffusion.limits import FOLDER_FILES, FOLDER_MESHES, MESH_FINE_FACES, SLOW_BYTES
from structdiffusion.objects import gltf
from structdiffusion.objects.mesh_process import prepare_apart
from structdiffusion.objects.model import ObjectError, ObjectModel

FORMATS = (".obj", ".stl", ".ply", *gltf.FORMATS)
LEGAL = f"{', '.join(FORMATS[:-1])} or {FORMATS[-1]}"
# Formats of other meshes, which a user may take for legal ones.
_OTHER_FORMATS = (
    ".dae", ".3mf", ".off", ".fbx", ".blend", ".usd", ".usda", ".usdc", ".usdz", ".step", ".stp", ".iges", ".igs",
    ".3ds", ".wrl", ".x3d", ".amf", ".drc", ".ctm", ".abc", ".3dxml", ".vrm", ".sldprt", ".skp", ".max", ".c4d",
)  # fmt: skip
_log = logging.getLogger("structagent")  # shows warnings on standard error


def folder_objects(folder: Path, *, alternatives: tuple[str, ...] = ()) -> list[ObjectModel]:
    """Load the objects of the mesh files in `folder` and below it, in the order of their names.

    The category is the noun in the name of a file, or of a node where a file has several objects, or of a subfolder.
    The first load of a mesh takes seconds, later loads use the cache. The mass is 400 kg per cubic metre of convex
    hull, the friction 0.5. Hidden files and folders are left out in silence, files of other formats and links to
    folders with a warning.

    Args:
        alternatives: names of libraries that an error message suggests instead.

    Raises:
        ObjectError: if there is no such folder, no mesh in it, or a mesh cannot be used; the message says which.
    """
    if not folder.is_dir():
        others = f", or one of {', '.join(alternatives)}" if alternatives else ""
        raise ObjectError(f"no folder of meshes at {str(folder)!r}: give a folder that exists{others}")
    files, left_out = _mesh_files(folder)
    told = _left_out(folder, left_out)
    if not files:
        wanted = ", ".join(FORMATS)
        raise ObjectError(f"the folder {str(folder)!r} holds no mesh: it needs files ending in {wanted}{told}")
    if told:
        _log.warning("the folder %r is read%s", str(folder), told)
    # "mug.obj" and "mug.stl" side by side are two objects; names are unique.
    inside = [path.relative_to(folder) for path in files]
    names: set[str] = set()
    models: list[ObjectModel] = []
    for path, relative in zip(files, inside, strict=True):
        name = relative.with_suffix("").as_posix()
        for model in objects_from_file(path, name if name not in names else relative.as_posix()):
            own = model.name if model.name not in names else f"{relative.as_posix()}/{model.name}"
            names.add(own)
            models.append(model if own == model.name else replace(model, name=own))
    return models


def _mesh_files(folder: Path) -> tuple[list[Path], list[Path]]:
    """Return the meshes in a folder and below it, and what one may take for a mesh there and is none.

    Links to files are followed, those to folders are not: they can lead round in a circle.
    """
    meshes, others, seen = [], [], 0
    for inside, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        others += [Path(inside, name) for name in folders if Path(inside, name).is_symlink()]
        seen += len(files) + len(folders)
        for name in files:
            path = Path(inside, name)
            if name.startswith(".") or not path.is_file():
                continue
            if path.suffix.lower() in FORMATS:
                meshes.append(path)
            elif path.suffix.lower() in _OTHER_FORMATS:
                others.append(path)
        if seen > FOLDER_FILES or len(meshes) > FOLDER_MESHES:
            raise ObjectError(
                f"the folder {str(folder)!r} holds more than {FOLDER_FILES} files or {FOLDER_MESHES} meshes: "
                "name the folder of the meshes that are wanted"
            )
    return sorted(meshes, key=lambda path: path.relative_to(folder).parts), others


def _left_out(folder: Path, paths: Sequence[Path]) -> str:
    if not paths:
        return ""
    names = sorted(path.relative_to(folder).as_posix() for path in paths)
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    links = ", links to folders are not followed" if any(path.is_dir() for path in paths) else ""
    return f" without {', '.join(map(repr, names[:3]))}{more}: meshes end in {LEGAL}{links}"


def object_from_file(path: Path, name: str, category: str | None = None, part: str | None = None) -> ObjectModel:
    """Load one object of a mesh file.

    Args:
        path, name, category: as for `objects_from_file`.
        part: the name of its node, for a file that holds several objects.

    Raises:
        ObjectError: as `objects_from_file`, and if the file has other objects than this one.
    """
    models = objects_from_file(path, name, category)
    if part is None and len(models) == 1:
        return models[0]
    for model in models:
        if part is not None and model.file == path / part:
            return model
    parts = [model.file.name if model.file and model.file != path else "" for model in models]
    if not parts[0]:
        raise ObjectError(f"the mesh {str(path)!r} is one object, and has no {part!r}")
    several = ", ".join(parts[:6]) + (f" and {len(parts) - 6} more" if len(parts) > 6 else "")
    raise ObjectError(
        f"the mesh {str(path)!r} holds {len(parts)} objects that stand apart, {several}: name one, such as "
        f"{path.name + '/' + parts[0]!r}, or save each in a file of its own"
    )


def objects_from_file(path: Path, name: str, category: str | None = None) -> list[ObjectModel]:
    """Load the objects of one mesh file. A large mesh is prepared in a separate process, which has a time limit.

    Args:
        path: a file of one of `FORMATS` in metres: .glb and .gltf with y up, as their standard says, others with z up.
        name: its name; its colour follows from it. Each of several objects has the name of its node.
        category: its noun; by default that in its name.

    Raises:
        ObjectError: if the mesh cannot be used, or takes more than `structdiffusion.limits.MESH_SECONDS` to prepare;
            the message says why.
    """
    if _is_large(path):
        return prepare_apart(path, name, category)
    from structdiffusion.objects.mesh_preparation import prepare  # it takes long to import, and most runs read no mesh

    return prepare(path, name, category)


def _is_large(path: Path) -> bool:
    """Return whether preparing the mesh may take more than a few seconds."""
    if path.stat().st_size > SLOW_BYTES:
        return True
    try:
        return path.suffix.lower() in gltf.FORMATS and gltf.gltf_faces(path) > MESH_FINE_FACES
    except ValueError:  # reading the mesh reports the error
        return False
