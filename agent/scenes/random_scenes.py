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

_SEVERAL = 4  # objects of a noun that make it worth talking about
_FEW, _MANY = 2, 3  # of the two nouns of an assortment


def assortment(library: Sequence[ObjectModel], rng: np.random.Generator, turn: int = 0) -> DrawnScene:
    """Draw a table for a conversation: a few objects of two nouns where the library has several of them, and one
    other.

    Args:
        library: the objects to draw from.
        rng: the only source of chance.
        turn: which noun has three objects on the table: 0 for the one that the library has most objects of, as a first
            table is best of something that everybody knows, 1 for the next, and so on in turn.

    Raises:
        SceneError: if the library has too few objects that fit on the table together.
    """
    pool = eligible(library, "circle")
    number = Counter(model.category for model in pool)
    frequent = [noun for noun, count in number.items() if count >= _SEVERAL]
    several = sorted(frequent, key=lambda noun: (-number[noun], noun))
    if len(several) < 2:
        return draw_scene(library, StructureSpec("line"), rng, distractors=1)
    first = several[turn % len(several)]
    second = str(rng.choice([noun for noun in several if noun != first]))
    some = [pool[i] for i in rng.permutation(len(pool))]
    these = [model for model in some if model.category == first][:_MANY]
    these += [model for model in some if model.category == second][:_FEW]
    others = [model for model in some if model.category not in (first, second)]
    return draw_scene(
        [*these, *others], StructureSpec("circle"), rng, categories=(first, second), count=len(these), distractors=1
    )


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
