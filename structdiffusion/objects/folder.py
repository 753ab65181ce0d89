"""Objects from a folder of the user's own meshes: .obj, .stl, .ply or .glb, in metres, z up."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import numpy as np
import trimesh

from structdiffusion.limits import MESH_BYTES, MESH_FACES, MESH_FINE_FACES, SLOW_BYTES, glb_faces
from structdiffusion.objects.meshes import coarser, object_from_mesh
from structdiffusion.objects.model import ObjectError, ObjectModel
from structdiffusion.objects.preparation import prepared_apart

FORMATS = (".obj", ".stl", ".ply", ".glb")
SMALLEST, LARGEST = 0.005, 0.5
# Kilograms per cubic metre of hull: most household things are hollow or light.
_DENSITY = 400.0
_FRICTION = 0.5
# The nouns that a file name may say.
NOUNS = (
    "fork", "knife", "spatula", "spoon", "plate", "saucer", "bowl", "mug", "cup", "glass", "saucepan",
    "skillet", "pan", "pot", "pitcher", "jug", "teapot", "kettle", "bottle", "jar", "can", "box", "block",
    "brick", "cube", "book", "ball", "apple", "banana", "lemon", "orange", "peach", "pear", "plum",
    "strawberry", "sponge", "hammer", "wrench", "screwdriver", "scissors", "clamp", "marker", "pen",
    "pencil", "brush", "candle", "vase", "basket", "tray", "lid", "drill", "padlock", "car",
    "airplane", "toy",
)  # fmt: skip
_PLURALS = {
    "knives": "knife", "glasses": "glass", "boxes": "box", "brushes": "brush", "strawberries": "strawberry",
}  # fmt: skip


def category_of(stem: str) -> str:
    """The noun in a file's name: "red_mug_2" gives "mug", "SoupCan" gives "can"; otherwise its words.

    The last known noun counts, as in "sugar box"; without one, the name without its numbers.
    """
    spaced = re.sub(r"([a-z])([A-Z])", r"\1 \2", stem)
    words = [word.lower() for word in re.findall(r"[^\W\d_]+", spaced) if len(word) > 1]
    for word in reversed(words):
        for noun in (_PLURALS.get(word, word), word.removesuffix("s")):
            if noun in NOUNS:
                return noun
    return " ".join(words) or stem


def folder_objects(folder: Path, *, alternatives: tuple[str, ...] = ()) -> list[ObjectModel]:
    """One ObjectModel per mesh file in `folder` (not in folders inside it), in the order of their names.

    The category is the noun in the file's name. The first load of a mesh takes seconds, later ones come
    from the cache. The mass is 400 kg per cubic metre of convex hull, the friction 0.5.

    Args:
        alternatives: names of libraries that an error may offer instead.

    Raises:
        ObjectError: no such folder, no mesh in it, or a mesh that cannot be used; the message says which.
    """
    if not folder.is_dir():
        others = f", or one of {', '.join(alternatives)}" if alternatives else ""
        raise ObjectError(f"no folder of meshes at {str(folder)!r}: give a folder that exists{others}")
    files = sorted(path for path in folder.iterdir() if path.suffix.lower() in FORMATS and path.is_file())
    if not files:
        wanted = ", ".join(FORMATS)
        raise ObjectError(f"the folder {str(folder)!r} holds no mesh: it needs files ending in {wanted}")
    taken: set[str] = set()
    models = []
    for path in files:
        # "mug.obj" and "mug.stl" side by side are two objects; names are unique.
        name = path.stem if path.stem not in taken else path.name
        taken.add(name)
        models.append(object_from_file(path, name))
    return models


def object_from_file(path: Path, name: str, category: str | None = None) -> ObjectModel:
    """The object of one mesh file. A large one is prepared in a process of its own, which is ended when it takes too long.

    Args:
        path: a .obj, .stl, .ply or .glb file in metres, z up.
        name: its name; its colour follows from it.
        category: its noun; by default that in the file's name.

    Raises:
        ObjectError: a mesh that cannot be used, or takes more than `structdiffusion.limits.MESH_SECONDS` to prepare; the
            message says why.
    """
    category = category or category_of(path.stem)
    return prepared_apart(path, name, category) if _is_large(path) else prepared(path, name, category)


def prepared(path: Path, name: str, category: str) -> ObjectModel:
    """As `object_from_file`, in this process and however long it takes."""
    mesh = _read(path)
    size = float(mesh.extents.max())
    if not SMALLEST <= size <= LARGEST:
        raise ObjectError(
            f"the mesh {str(path)!r} is {size:.4g} m long: the unit must be metres, "
            f"and objects between {SMALLEST} and {LARGEST} m"
        )
    # A colour of its own for each name, the same in every run.
    hue = hashlib.sha256(name.encode()).digest()
    try:
        return object_from_mesh(
            mesh,
            name=name,
            category=category,
            source="folder",
            mass=float(np.clip(_DENSITY * mesh.convex_hull.volume, 0.005, 2.0)),
            friction=_FRICTION,
            color=(0.25 + hue[0] / 425, 0.25 + hue[1] / 425, 0.25 + hue[2] / 425),
        )
    except (ValueError, RuntimeError, ArithmeticError) as error:  # Qhull's errors are RuntimeErrors
        message = f"the mesh {str(path)!r} cannot be used: it does not enclose a volume ({_reason(error)})"
        raise ObjectError(message) from error


def _reason(error: Exception) -> str:
    """The first line of an error's message, or its name where it says nothing."""
    lines = str(error).strip().splitlines()
    return lines[0] if lines else type(error).__name__


def _is_large(path: Path) -> bool:
    """Whether preparing the mesh may take more than seconds."""
    if path.stat().st_size > SLOW_BYTES:
        return True
    try:
        return path.suffix.lower() == ".glb" and glb_faces(path) > MESH_FINE_FACES
    except ValueError:  # reading it says what is wrong
        return False


def _read(path: Path) -> trimesh.Trimesh:
    if (size := path.stat().st_size) > MESH_BYTES:
        raise ObjectError(f"the mesh {str(path)!r} has {size} bytes; at most {MESH_BYTES} are read: simplify it")
    # Readers of broken files raise nearly anything (struct, index, key, json, unicode errors).
    try:
        if path.suffix.lower() == ".glb":
            _check_faces(path, glb_faces(path))  # before anything is made: a kilobyte can place a mesh a million times
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
