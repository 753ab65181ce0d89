"""A simulated table: objects drawn from a library so that the wish can come true, seen by the depth camera."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from agent.scenes.table import TableScene, drawing_and_noise
from grounding.selection import SelectionError
from grounding.spec import StructureSpec
from structdiffusion.objects.model import ObjectModel
from structdiffusion.scenes import DrawnScene, SceneError, draw_scene

Select = Callable[[Sequence[str]], Sequence[int]]
MOST_OBJECTS = 7  # that take part in a drawn scene
_DRAWS = 60  # a few suffice unless the instruction asks for a rare mixture, such as two cans and the only mug


class SimulatedScene(TableScene):
    """A table with objects that were drawn for the instruction.

    Args:
        library: the objects to draw from.
        spec: what will be asked for; open slots stay open.
        select: takes the noun of each object, and gives the indices of those that the instruction means.
        seed: everything about the scene follows from it: objects, poses and the sensor's noise.

    Raises:
        SceneError: when these objects cannot make such a structure on this table.
    """

    def __init__(self, library: Sequence[ObjectModel], spec: StructureSpec, select: Select, seed: int) -> None:
        drawing, noise = drawing_and_noise(seed)
        drawn = draw_meant_scene(library, spec, select, drawing)
        super().__init__(drawn.models, drawn.world_from_initial, drawn.count, noise, drawn.table)


def draw_meant_scene(
    library: Sequence[ObjectModel], spec: StructureSpec, select: Select, rng: np.random.Generator
) -> DrawnScene:
    """A scene in which the instruction means exactly the objects that take part.

    Args: as `SimulatedScene`.

    Raises:
        SceneError: when these objects cannot make such a structure, or no draw has the mixture that is asked for.
    """
    nouns = [model.category for model in library]
    meant = select(nouns)
    categories = sorted({nouns[index] for index in meant})
    of_these = sum(noun in categories for noun in nouns)
    everything = len(meant) == len(library)
    # Fewer than there are of these nouns: the instruction gives numbers, or speaks of single things.
    counted = len(meant) < of_these
    for _ in range(_DRAWS):
        drawn = draw_scene(
            library,
            spec,
            rng,
            categories=() if everything else categories,
            count=len(meant) if counted and len(meant) <= MOST_OBJECTS else None,
            # Where no noun says what is meant, all that stands on the table is.
            distractors=0 if everything else None,
        )
        try:
            chosen = select([model.category for model in drawn.models])
        except SelectionError:  # something that the instruction names, or enough of it, was not drawn
            counted = True
            continue
        if set(chosen) == set(range(drawn.count)):
            return drawn
    raise SceneError(f"no scene in {_DRAWS} draws has just the objects that the instruction means")
