"""Simulate a table: objects drawn from a library so that the goal can be built, seen by the depth camera."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from agent.arm.arm_model import ArmModel
from agent.scenes.object_attributes import attributes_of
from agent.scenes.table_scene import TableScene, drawing_and_noise
from agent.scenes.workcell import Workcell
from grounding.resolve.attributes import SceneObject
from structdiffusion.data.scene_sampling import DrawnScene, SceneError, draw_scene, eligible
from structdiffusion.objects.model import ObjectModel, unique_names

if TYPE_CHECKING:
    from grounding.interpretation import Interpretation

MOST_OBJECTS = 7  # that take part in a drawn scene
_DRAWS = 60  # a few suffice unless the instruction asks for a rare mixture, such as two cans and the only mug
_OTHERS = 3  # objects of the same nouns that stand around at most where colours or sizes say which are meant


class SimulatedScene(TableScene):
    """A table with objects that were drawn for the instruction.

    Args:
        library: the objects to draw from.
        goal: what will be asked for, with the objects of the library that it selected; open slots stay open.
        seed: everything about the scene follows from it: objects, poses and the sensor's noise.
        arm: another arm than the Jaco.

    Raises:
        SceneError: if these objects cannot make such a structure on this table.
    """

    def __init__(
        self, library: Sequence[ObjectModel], goal: Interpretation, seed: int, arm: ArmModel | None = None
    ) -> None:
        drawing, noise = drawing_and_noise(seed)
        drawn = draw_goal_scene(library, goal, drawing)
        super().__init__(drawn.models, drawn.world_from_initial, drawn.count, noise, Workcell(drawn.table, model=arm))


def described(models: Sequence[ObjectModel]) -> list[SceneObject]:
    """Return the objects as an instruction can refer to them, by their nouns, numbered where there are several of
    one."""
    return [SceneObject(name, attributes_of(model)) for name, model in zip(unique_names(models), models, strict=True)]


def draw_goal_scene(library: Sequence[ObjectModel], goal: Interpretation, rng: np.random.Generator) -> DrawnScene:
    """Draw a scene in which the instruction selects exactly the participants.

    Args: as for `SimulatedScene`.

    Raises:
        SceneError: if these objects cannot make such a structure, or no draw has the mixture that is asked for.
    """
    nouns = [model.category for model in library]
    assert goal.selection is not None
    selected = goal.selection.indices
    if goal.selection.described:
        return _draw_described(library, [library[index] for index in selected], goal, rng)
    categories = sorted({nouns[index] for index in selected})
    of_these = sum(noun in categories for noun in nouns)
    everything = len(selected) == len(library)
    # Fewer than there are of these nouns: the instruction gives numbers, or speaks of single things.
    counted = len(selected) < of_these
    for _ in range(_DRAWS):
        drawn = draw_scene(
            library,
            goal.spec,
            rng,
            categories=() if everything else categories,
            count=len(selected) if counted and len(selected) <= MOST_OBJECTS else None,
            # Where no noun says what is meant, all that stands on the table is.
            distractors=0 if everything else None,
        )
        there = goal.among(described(drawn.models))
        if there.selection is None:  # something that the instruction names, or enough of it, was not drawn
            counted = True
        elif set(there.selection.indices) == set(range(drawn.count)):
            return drawn
    raise SceneError(f"no scene in {_DRAWS} draws has just the objects that the instruction means")


def _draw_described(
    library: Sequence[ObjectModel], fitting: Sequence[ObjectModel], goal: Interpretation, rng: np.random.Generator
) -> DrawnScene:
    """Draw a scene for an instruction that distinguishes objects by colour or size, with others of the same nouns.

    Args:
        fitting: the objects of the library that the instruction may mean.
        library, goal, rng: as for `draw_goal_scene`.

    Raises:
        SceneError: as raised by `draw_goal_scene`.
    """
    suited = eligible(fitting, goal.spec.shape)
    nouns = {model.category for model in fitting}
    names = {model.name for model in fitting}
    alike = [model for model in library if model.category in nouns and model.name not in names]
    # Sizes compare what stands on the table, so that others of the same nouns can be among those that fit.
    contrast = eligible(alike or suited, None)
    reason = f"{len(suited)} of the {len(fitting)} objects that it can mean suit a {goal.spec.shape or 'structure'}"
    if len(suited) < 2:
        raise SceneError(f"cannot make a {goal.spec.shape or 'structure'}: only {reason}; 2 or more are needed")
    for _ in range(_DRAWS):
        some = [suited[i] for i in rng.permutation(len(suited))[: int(rng.integers(2, MOST_OBJECTS + 1))]]
        others = [contrast[i] for i in rng.permutation(len(contrast))[: int(rng.integers(1, _OTHERS + 1))]]
        taken = {model.name for model in some}
        models = [*some, *(model for model in others if model.name not in taken)]
        there = goal.among(described(models))
        if there.selection is None:
            reason = there.message
            continue
        try:
            members = [models[index] for index in there.selection.indices]
            drawn = draw_scene(models, goal.spec, rng, members=members, attempts=1)
        except SceneError as error:
            reason = str(error)
            continue
        there = goal.among(described(drawn.models))
        if there.selection is None:
            reason = there.message
        elif set(there.selection.indices) == set(range(drawn.count)):
            return drawn
    raise SceneError(f"no scene in {_DRAWS} draws has the objects that the instruction means: {reason}")
