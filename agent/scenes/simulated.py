"""A simulated table: objects drawn from a library so that the wish can come true, seen by the depth camera."""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Scene
from structdiffusion.scenes import draw_scene
from structdiffusion.tabletop import TabletopWorld


class SimulatedScene:
    """A table with objects at rest; use it in a `with` block, which ends its physics.

    Args:
        models: the object library.
        spec: what will be asked for; open slots stay open.
        named: nouns of the objects that must take part; empty leaves the choice free, and then nothing
            else stands on the table, because all that stands there takes part.
        seed: everything about the scene follows from it: objects, poses and the sensor's noise.

    Attributes:
        drawn: the objects, and where they stood at first.
        world: the physics that the arm acts in.

    Raises:
        SceneError: when these objects cannot make such a structure on this table.
    """

    def __init__(self, models: Sequence[ObjectModel], spec: StructureSpec, named: Sequence[str], seed: int) -> None:
        drawing, self._noise = (np.random.default_rng(part) for part in np.random.SeedSequence(seed).spawn(2))
        self.drawn = draw_scene(models, spec, drawing, categories=named, distractors=None if named else 0)
        self.world = TabletopWorld(self.drawn.models, self.drawn.world_from_initial, self.drawn.table)

    def __enter__(self) -> SimulatedScene:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.world.close()

    @property
    def categories(self) -> tuple[str, ...]:
        """The noun of every object on the table, in the order of the world's bodies."""
        return tuple(model.category for model in self.drawn.models)

    def look(self, taking_part: Sequence[int]) -> Scene:
        """What the camera sees; `taking_part` are indices of the world's bodies, the others are distractors."""
        others = [index for index in range(len(self.drawn.models)) if index not in set(taking_part)]
        return self.world.observe(self._noise, objects=list(taking_part), distractors=others)

    def picture(self) -> np.ndarray:
        """A picture (H, W, 3) uint8 of the table as it is now, through the camera."""
        return self.world.picture("robot")
