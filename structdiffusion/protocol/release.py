"""Say what is on the table when an arrangement is released in physics, and how it is released."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from structdiffusion.evaluation_protocol import RELEASE_HEIGHT
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Table
from structdiffusion.simulation.world import TabletopWorld


@dataclass(frozen=True)
class TabletopBodies:
    """The rigid bodies on a table before anything is released.

    Attributes:
        models: the N objects that take part, or all that a goal counts.
        world_from_initial: (N, 4, 4) their poses now.
        table: the table top.
        others: distractors with their poses (4, 4); they are in the world all the time.
        names: the names of the objects, then of the others, in the verdict; by default their nouns, numbered.
        ground: the whole surface that carries objects, if it is larger than the table top.
        held: which objects, and others after them, keep their places as long as they are not released; they stand in
            the world, but a completed body of them would not.
        colors: for a goal that groups by colour, the name of each object's colour.
    """

    models: Sequence[ObjectModel]
    world_from_initial: np.ndarray | Sequence[np.ndarray]
    table: Table = Table()
    others: Sequence[tuple[ObjectModel, np.ndarray]] = ()
    names: Sequence[str] | None = None
    ground: Table | None = None
    held: Sequence[int] = ()
    colors: Sequence[str] | None = None


@dataclass(frozen=True)
class Release:
    """How objects are released, and how long physics runs until they are judged.

    Attributes:
        until_rest: judge as soon as everything is at rest, and not after the 2 s of the evaluation protocol.
        together: release all objects at the same time, not one after another. Objects that all stand on the table do
            not feel the difference, and there are as many times fewer steps of physics.
        far_first: of objects that are equally low, release the farthest first, as the arm builds, and not the widest.
        order: of the objects that are released, if it is given; by default supports first.
        above: m above its goal from which each is released.
        on_end: called with the world as it is in the end, such as to take a picture of it.
    """

    until_rest: bool = False
    together: bool = False
    far_first: bool = False
    order: tuple[int, ...] = ()
    above: float = RELEASE_HEIGHT
    on_end: Callable[[TabletopWorld], None] | None = None
