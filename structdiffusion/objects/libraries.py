"""Load objects by name of a built-in library, or from a folder of the user's own meshes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from structdiffusion.objects.blocks import block_objects
from structdiffusion.objects.everyday import everyday_objects
from structdiffusion.objects.folder import folder_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.objects.procedural import procedural_objects
from structdiffusion.objects.urdfs import random_urdfs_objects
from structdiffusion.objects.ycb import ycb_objects

TRAINING_COUNT = 600  # number of procedural objects for training; later ones are for validation only


def training_objects() -> list[ObjectModel]:
    """Return the training objects: the first 600 procedural objects and 200 of PyBullet's random ones."""
    return procedural_objects(TRAINING_COUNT) + random_urdfs_objects()


def validation_objects() -> list[ObjectModel]:
    """Return objects that no model has seen, half of them of kinds that no model has seen either."""
    return procedural_objects(first=TRAINING_COUNT) + everyday_objects()


def unseen_urdfs_objects() -> list[ObjectModel]:
    """Return 200 of PyBullet's random bodies that no model was trained on: those after the training objects."""
    return random_urdfs_objects(first=len(random_urdfs_objects()))


LIBRARIES: dict[str, Callable[[], list[ObjectModel]]] = {
    "procedural": procedural_objects,
    "random_urdfs": random_urdfs_objects,
    "ycb": ycb_objects,
    "training": training_objects,
    "validation": validation_objects,
    "blocks": block_objects,
    "unseen_urdfs": unseen_urdfs_objects,
}


def load_objects(source: str | Path) -> list[ObjectModel]:
    """Load the objects of a library, or of a folder of meshes.

    Args:
        source: "procedural", "random_urdfs", "ycb", "training", "validation", "blocks", "unseen_urdfs", or the
            path of a folder of meshes (see `folder_objects`). For a folder with the name of a library, give a path such
            as "./ycb".

    Raises:
        ObjectError: if there is no such library or folder, or it has no usable mesh.
    """
    if isinstance(source, str) and source in LIBRARIES:
        return LIBRARIES[source]()
    return folder_objects(Path(source), alternatives=tuple(LIBRARIES))
