"""A simulated table: objects drawn from a library so that the goal can be built, seen by the depth camera."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from agent.scenes.object_attributes import attributes_of
from agent.scenes.table_scene import TableScene, drawing_and_noise
from grounding.references.attributes import SceneObject
from grounding.references.selection import Selection, SelectionError
from grounding.spec import StructureSpec
from structdiffusion.data.scene_sampling import DrawnScene, SceneError, draw_scene, eligible
from structdiffusion.objects.model import ObjectModel
from structdiffusion.simulation.world import unique_names

MOST_OBJECTS = 7  # that take part in a drawn scene
_DRAWS = 60  # a few suffice unless the instruction asks for a rare mixture, such as two cans and the only mug
_OTHERS = 3  # objects of the same nouns that stand around at most where colours or sizes say which are meant


class Select(Protocol):
    """Finds the objects that an instruction means."""

    def __call__(self, objects: Sequence[SceneObject], catalogue: bool = False) -> Selection:
        """Select among the objects of a scene, or of the library (`catalogue`) that one is drawn from.

        Raises:
            SelectionError: when something is named that is not there.
        """


class SimulatedScene(TableScene):
    """A table with objects that were drawn for the instruction.

    Args:
        library: the objects to draw from.
        referents: the same, as an instruction can refer to them.
        spec: what will be asked for; open slots stay open.
        select: finds the objects that the instruction means.
        seed: everything about the scene follows from it: objects, poses and the sensor's noise.

    Raises:
        SceneError: when these objects cannot make such a structure on this table.
    """

    def __init__(
        self,
        library: Sequence[ObjectModel],
        referents: Sequence[SceneObject],
        spec: StructureSpec,
        select: Select,
        seed: int,
    ) -> None:
        drawing, noise = drawing_and_noise(seed)
        drawn = draw_meant_scene(library, referents, spec, select, drawing)
        super().__init__(drawn.models, drawn.world_from_initial, drawn.count, noise, drawn.table)


def described(models: Sequence[ObjectModel]) -> list[SceneObject]:
    """Return the objects as an instruction can refer to them, by their nouns, numbered where there are several of
    one."""
    return [SceneObject(name, attributes_of(model)) for name, model in zip(unique_names(models), models, strict=True)]


def draw_meant_scene(
    library: Sequence[ObjectModel],
    referents: Sequence[SceneObject],
    spec: StructureSpec,
    select: Select,
    rng: np.random.Generator,
) -> DrawnScene:
    """Return a scene in which the instruction means exactly the objects that take part.

    Args: as `SimulatedScene`.

    Raises:
        SceneError: when these objects cannot make such a structure, or no draw has the mixture that is asked for.
    """
    nouns = [model.category for model in library]
    selection = select(referents, catalogue=True)
    selected = selection.indices
    if selection.described:
        return _draw_described(library, [library[index] for index in selected], spec, select, rng)
    categories = sorted({nouns[index] for index in selected})
    of_these = sum(noun in categories for noun in nouns)
    everything = len(selected) == len(library)
    # Fewer than there are of these nouns: the instruction gives numbers, or speaks of single things.
    counted = len(selected) < of_these
    for _ in range(_DRAWS):
        drawn = draw_scene(
            library,
            spec,
            rng,
            categories=() if everything else categories,
            count=len(selected) if counted and len(selected) <= MOST_OBJECTS else None,
            # Where no noun says what is meant, all that stands on the table is.
            distractors=0 if everything else None,
        )
        try:
            chosen = select(described(drawn.models)).indices
        except SelectionError:  # something that the instruction names, or enough of it, was not drawn
            counted = True
            continue
        if set(chosen) == set(range(drawn.count)):
            return drawn
    raise SceneError(f"no scene in {_DRAWS} draws has just the objects that the instruction means")


def _draw_described(
    library: Sequence[ObjectModel],
    fitting: Sequence[ObjectModel],
    spec: StructureSpec,
    select: Select,
    rng: np.random.Generator,
) -> DrawnScene:
    """A scene for an instruction that tells objects apart by colour or size: others of their nouns stand there too.

    Args:
        fitting: the objects of the library that the instruction may mean.
        library, spec, select, rng: as `draw_meant_scene`.

    Raises:
        SceneError: as `draw_meant_scene`.
    """
    suited = eligible(fitting, spec.shape)
    nouns = {model.category for model in fitting}
    names = {model.name for model in fitting}
    alike = [model for model in library if model.category in nouns and model.name not in names]
    # Sizes compare what stands on the table, so that others of the same nouns can be among those that fit.
    contrast = eligible(alike or suited, None)
    reason = f"{len(suited)} of the {len(fitting)} objects that it can mean suit a {spec.shape or 'structure'}"
    if len(suited) < 2:
        raise SceneError(f"cannot make a {spec.shape or 'structure'}: only {reason}; 2 or more are needed")
    for _ in range(_DRAWS):
        some = [suited[i] for i in rng.permutation(len(suited))[: int(rng.integers(2, MOST_OBJECTS + 1))]]
        others = [contrast[i] for i in rng.permutation(len(contrast))[: int(rng.integers(1, _OTHERS + 1))]]
        taken = {model.name for model in some}
        models = [*some, *(model for model in others if model.name not in taken)]
        try:
            selected = select(described(models)).indices
            members = [models[index] for index in selected]
            drawn = draw_scene(models, spec, rng, members=members, attempts=1)
            if set(select(described(drawn.models)).indices) == set(range(drawn.count)):
                return drawn
        except (SelectionError, SceneError) as error:
            reason = str(error)
    raise SceneError(f"no scene in {_DRAWS} draws has the objects that the instruction means: {reason}")
