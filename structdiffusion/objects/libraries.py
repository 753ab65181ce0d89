"""One door to every object: the built-in libraries by name, or a folder of the user's own meshes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from structdiffusion.objects.everyday import everyday_objects
from structdiffusion.objects.folder import folder_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.objects.procedural import procedural_objects
from structdiffusion.objects.urdfs import random_urdfs_objects
from structdiffusion.objects.ycb import ycb_objects

TRAINING_COUNT = 600  # of the procedural objects; those after them are for validation alone


def training_objects() -> list[ObjectModel]:
    """What the models are trained on: the first 600 procedural objects and 200 of PyBullet's random ones."""
    return procedural_objects(TRAINING_COUNT) + random_urdfs_objects()


def validation_objects() -> list[ObjectModel]:
    """Procedural objects that no model has seen, half of them of kinds that it has not seen either."""
    return procedural_objects()[TRAINING_COUNT:] + everyday_objects()


LIBRARIES: dict[str, Callable[[], list[ObjectModel]]] = {
    "procedural": procedural_objects,
    "random_urdfs": random_urdfs_objects,
    "ycb": ycb_objects,
    "training": training_objects,
    "validation": validation_objects,
}


def load_objects(source: str | Path) -> list[ObjectModel]:
    """The objects of a library, or of a folder of meshes.

    Args:
        source: "procedural", "random_urdfs", "ycb", "training", "validation", or the path of a folder of .obj, .stl, .ply or
            .glb files in metres, z up. A folder that is called like a library is meant by "./ycb".

    Raises:
        ObjectError: when there is no such library or folder, or it holds no usable mesh.
    """
    if isinstance(source, str) and source in LIBRARIES:
        return LIBRARIES[source]()
    return folder_objects(Path(source), alternatives=tuple(LIBRARIES))
