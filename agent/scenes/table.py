"""A simulated table with objects at rest and the folded arm beside it, seen by the depth camera."""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType
from typing import Self

import numpy as np

from agent.arm.kinematics import JacoArm
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Scene, Table
from structdiffusion.tabletop import TabletopWorld, unique_names


class TableScene:
    """A table that the pipeline can look at and work on; use it in a `with` block, which ends its physics.

    Args:
        models: the objects, those that take part first.
        world_from_initial: (M, 4, 4) their poses.
        count: how many take part.
        noise: draws the sensor's noise.
        table: the table top.
        names: what the objects are called, unique; by default their nouns, numbered.

    Attributes:
        models, world_from_initial, count, names: as given.
        world: the physics that the arm acts in, its bodies in the same order.
        arm: the folded arm.
    """

    def __init__(
        self,
        models: Sequence[ObjectModel],
        world_from_initial: np.ndarray,
        count: int,
        noise: np.random.Generator,
        table: Table = Table(),
        names: Sequence[str] | None = None,
    ) -> None:
        self.models = tuple(models)
        self.world_from_initial = world_from_initial
        self.count = count
        self.names = tuple(unique_names(self.models) if names is None else names)
        self._noise = noise
        self.world = TabletopWorld(self.models, self.world_from_initial, table)
        self.arm = JacoArm(self.world.client)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.world.close()

    def look(self) -> Scene:
        """What the camera sees: the objects that take part, and the distractors."""
        return self.world.observe(
            self._noise,
            objects=range(self.count),
            distractors=range(self.count, len(self.models)),
            names=self.names,
        )

    def picture(self, view: str = "robot") -> np.ndarray:
        """A picture (H, W, 3) uint8 of the table as it is now: as the camera sees it, or from the "opposite" side."""
        return self.world.picture(view)


def drawing_and_noise(seed: int) -> tuple[np.random.Generator, np.random.Generator]:
    """What draws a scene, and what draws its sensor's noise: both follow from the seed."""
    drawing, noise = (np.random.default_rng(part) for part in np.random.SeedSequence(seed).spawn(2))
    return drawing, noise
