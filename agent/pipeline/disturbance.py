"""Prepare the disturbance of a run: where there can be one, and what it needs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from agent.errors import UsageError
from agent.scenes.sources import EXAMPLE, RECORDINGS
from grounding.parse_result import shortened

if TYPE_CHECKING:
    from agent.arm.disturbances import Disturbance, Disturber
    from agent.scenes.table_scene import TableScene
    from structdiffusion.observation import Arrangement


def check_disturbance(disturbance: Disturbance, scene: str, execute: bool) -> None:
    """Refuse a disturbance where nothing true stands on the table, or the arm does not build.

    Args:
        disturbance: what is asked for.
        scene: the source of the scene, as in `RunOptions`.
        execute: whether the arm builds.

    Raises:
        UsageError: in one sentence.
    """
    path = Path(scene)
    if scene == EXAMPLE or path.suffix.lower() in RECORDINGS or (scene and path.is_dir()):
        raise UsageError(
            f"--disturb {disturbance} is for simulated scenes, but --scene {shortened(scene)!r} is a recording of a "
            "real one"
        )
    if not execute:
        raise UsageError(
            f"--disturb {disturbance} needs the arm, but --no-execute does not use it; leave out one of them"
        )


def make_disturber(
    disturbance: Disturbance, table: TableScene, arrangements: Sequence[Arrangement], objects: str, seed: int
) -> Disturber:
    """Return what disturbs a build on a table, before anything has moved.

    Args:
        disturbance: what is to happen.
        table: the table.
        arrangements: the goals that may be built.
        objects: the library from which an object is added, as for `load_objects`.
        seed: of the moment, the object and the way.

    Raises:
        BadInput: if an object is to be added and the library has none that is small enough.
    """
    from agent.arm.disturbances import DISTURBANCES, Disturber
    from agent.arm.interference import spare_model
    from structdiffusion.objects.libraries import load_objects

    rng = np.random.default_rng((seed, DISTURBANCES.index(disturbance.kind)))
    initial = np.array(list(table.poses().values())[: table.count])
    goals = np.array([one.goal_from_initial @ initial for one in arrangements])
    spare = None
    if disturbance.kind == "add":
        spare = table.keep_away(spare_model(load_objects(objects), table.models, rng))
    return Disturber(disturbance, table.world, table.arm, table.names, goals, rng, spare)
