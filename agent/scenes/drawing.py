"""New scene files, drawn at random."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from agent.scenes.files import PlacedObject
from agent.scenes.placing import drawn_objects, saved_objects
from grounding.spec import StructureSpec
from structdiffusion.objects.libraries import load_objects
from structdiffusion.scenes import draw_scene


def drawn_scene(objects: str, shape: str | None, seed: int, folder: Path) -> list[PlacedObject]:
    """The lines of a new scene file in `folder`: objects that can make a structure, and up to two others.

    Args:
        objects: a library or a folder of meshes, as `load_objects` takes it.
        shape: which structure, one of `grounding.spec.SHAPES`; `None` for any.
        seed: the scene follows from it.
        folder: where the file will be.

    Raises:
        SceneError: when these objects can make none.
        ObjectError: when there are no such objects.
    """
    drawn = draw_scene(load_objects(objects), StructureSpec(shape), np.random.default_rng(seed))
    poses = list(drawn.world_from_initial)
    lines = saved_objects(drawn_objects(drawn.models, poses, objects), poses, folder)
    # To be read and edited: everything was drawn 2 cm apart, and a tenth of a millimetre changes nothing.
    return [replace(line, x=round(line.x, 4), y=round(line.y, 4), yaw=round(line.yaw, 1)) for line in lines]
