"""Draw random scenes for new scene files and for conversations."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from agent.scenes.files import PlacedObject
from agent.scenes.object_placement import drawn_objects, saved_objects
from grounding.spec import StructureSpec
from structdiffusion.data.scene_sampling import DrawnScene, draw_scene, eligible
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import ObjectModel

# What the first sentences of the documents ask for, and where: cups in a small circle on the left, cans in a tower.
_SPOKEN_OF = {"cup": 4, "can": 3}
_ROOM_FOR = StructureSpec("circle", "small", "left")
_WIDEST = 0.08  # m, radius of what stands there: so many objects have to leave room for a structure
_SEVERAL = 2  # objects of a noun that make it worth talking about


def assortment(library: Sequence[ObjectModel], rng: np.random.Generator, turn: int = 0) -> DrawnScene:
    """Draw a table for a conversation: four cups and three cans, which the first sentences of the documents ask for,
    with room for a small circle of the cups on the left, and two of another noun.

    Without so many cups and cans in the library, draw a line and one other object.

    Args:
        library: the objects to draw from.
        rng: the only source of chance.
        turn: which other noun has two objects on the table: 0 for the one that the library has most objects of, 1 for
            the next, and so on in turn.

    Raises:
        SceneError: if the library has too few objects that fit on the table together.
    """
    pool = [model for model in eligible(library, "circle") if model.radius < _WIDEST]
    some = [pool[i] for i in rng.permutation(len(pool))]
    number = Counter(model.category for model in some)
    if any(number[noun] < count for noun, count in _SPOKEN_OF.items()):
        return draw_scene(library, StructureSpec("line"), rng, distractors=1)
    further = sorted((noun for noun in number if noun not in _SPOKEN_OF), key=lambda noun: (-number[noun], noun))
    several = [noun for noun in further if number[noun] >= _SEVERAL]
    wanted = dict(_SPOKEN_OF)
    if several:
        wanted[several[turn % len(several)]] = _SEVERAL
    these = [model for noun, count in wanted.items() for model in _first(some, noun, count)]
    cups = [model for model in these if model.category == "cup"]
    return draw_scene(these, _ROOM_FOR, rng, members=cups)


def _first(models: Sequence[ObjectModel], noun: str, count: int) -> list[ObjectModel]:
    return [model for model in models if model.category == noun][:count]


def drawn_scene(objects: str, shape: str | None, seed: int, folder: Path) -> list[PlacedObject]:
    """Return the lines of a new scene file in `folder`: objects that can make a structure, and up to two others.

    Args:
        objects: a library or a folder of meshes, as for `load_objects`.
        shape: which structure, one of `grounding.spec.SHAPES`; `None` for any.
        seed: the scene follows from it.
        folder: the folder of the file.

    Raises:
        SceneError: if these objects can make none.
        ObjectError: if there are no such objects.
    """
    drawn = draw_scene(load_objects(objects), StructureSpec(shape), np.random.default_rng(seed))
    poses = list(drawn.world_from_initial)
    lines = saved_objects(drawn_objects(drawn.models, poses, objects), poses, folder)
    # To be read and edited: everything was drawn 2 cm apart, and a tenth of a millimetre changes nothing.
    return [replace(line, x=round(line.x, 4), y=round(line.y, 4), yaw=round(line.yaw, 1)) for line in lines]
