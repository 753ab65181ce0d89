"""Load objects from a folder of the user's own meshes: .obj, .stl, .ply or .glb, in metres, z up."""

from __future__ import annotations

import re
from pathlib import Path

from structdiffusion.limits import MESH_FINE_FACES, SLOW_BYTES, glb_faces
from structdiffusion.objects.mesh_process import prepare_apart
from structdiffusion.objects.model import ObjectError, ObjectModel

FORMATS = (".obj", ".stl", ".ply", ".glb")
# The nouns that are recognised in file names.
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
    """Return the noun in a file's name: "red_mug_2" gives "mug", "SoupCan" gives "can"; otherwise its words.

    The last known noun counts, as in "sugar box"; without a known noun, the result is the name without its numbers.
    """
    spaced = re.sub(r"([a-z])([A-Z])", r"\1 \2", stem)
    words = [word.lower() for word in re.findall(r"[^\W\d_]+", spaced) if len(word) > 1]
    for word in reversed(words):
        for noun in (_PLURALS.get(word, word), word.removesuffix("s")):
            if noun in NOUNS:
                return noun
    return " ".join(words) or stem


def folder_objects(folder: Path, *, alternatives: tuple[str, ...] = ()) -> list[ObjectModel]:
    """Load one ObjectModel per mesh file in `folder` (subfolders excluded), in the order of their names.

    The category is the noun in the file's name. The first load of a mesh takes seconds, later loads use the cache. The
    mass is 400 kg per cubic metre of convex hull, the friction 0.5.

    Args:
        alternatives: names of libraries that an error message suggests instead.

    Raises:
        ObjectError: if there is no such folder, no mesh in it, or a mesh cannot be used; the message says which.
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
    """Load the object of one mesh file. A large mesh is prepared in a separate process, which has a time limit.

    Args:
        path: a .obj, .stl, .ply or .glb file in metres, z up.
        name: its name; its colour follows from it.
        category: its noun; by default that in the file's name.

    Raises:
        ObjectError: if the mesh cannot be used, or takes more than `structdiffusion.limits.MESH_SECONDS` to prepare;
            the message says why.
    """
    category = category or category_of(path.stem)
    if _is_large(path):
        return prepare_apart(path, name, category)
    from structdiffusion.objects.mesh_preparation import prepare  # it takes long to import, and most runs read no mesh

    return prepare(path, name, category)


def _is_large(path: Path) -> bool:
    """Return whether preparing the mesh may take more than a few seconds."""
    if path.stat().st_size > SLOW_BYTES:
        return True
    try:
        return path.suffix.lower() == ".glb" and glb_faces(path) > MESH_FINE_FACES
    except ValueError:  # reading the mesh reports the error
        return False
