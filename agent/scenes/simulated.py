"""A simulated table: objects drawn from a library so that the wish can come true, seen by the depth camera."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import TracebackType

import numpy as np

from agent.arm.kinematics import JacoArm
from grounding.spec import StructureSpec
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Scene
from structdiffusion.scenes import draw_scene
from structdiffusion.tabletop import TabletopWorld


class SimulatedScene:
    """A table with objects at rest and the folded arm beside it; use it in a `with` block, which ends its physics.

    Args:
        library: the objects to draw from.
        spec: what will be asked for; open slots stay open.
        named: nouns of the objects that must take part; empty leaves the choice free, and then nothing
            else stands on the table, because all that stands there takes part.
        select: takes the noun of every object on the table, and gives the indices of those that are meant.
        seed: everything about the scene follows from it: objects, poses and the sensor's noise.

    Attributes:
        models, world_from_initial: the objects and their poses (M, 4, 4) at first; the `count` that take part first.
        world: the physics that the arm acts in, its bodies in the same order.
        arm: the folded arm.

    Raises:
        SceneError: when these objects cannot make such a structure on this table.
    """

    def __init__(
        self,
        library: Sequence[ObjectModel],
        spec: StructureSpec,
        named: Sequence[str],
        select: Callable[[Sequence[str]], Sequence[int]],
        seed: int,
    ) -> None:
        drawing, self._noise = (np.random.default_rng(part) for part in np.random.SeedSequence(seed).spawn(2))
        drawn = draw_scene(library, spec, drawing, categories=named, distractors=None if named else 0)
        meant = list(select([model.category for model in drawn.models]))
        order = meant + [index for index in range(len(drawn.models)) if index not in set(meant)]
        self.count = len(meant)
        self.models = tuple(drawn.models[index] for index in order)
        self.world_from_initial = drawn.world_from_initial[order]
        self.world = TabletopWorld(self.models, self.world_from_initial, drawn.table)
        self.arm = JacoArm(self.world.client)

    def __enter__(self) -> SimulatedScene:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.world.close()

    def look(self) -> Scene:
        """What the camera sees: the objects that take part, and the distractors."""
        return self.world.observe(
            self._noise, objects=range(self.count), distractors=range(self.count, len(self.models))
        )

    def picture(self) -> np.ndarray:
        """A picture (H, W, 3) uint8 of the table as it is now, through the camera."""
        return self.world.picture("robot")
