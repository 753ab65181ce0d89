"""Try a goal in physics without the arm: one step of the pipeline."""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import TYPE_CHECKING

import numpy as np

from agent import events
from agent.errors import NoValidGoal
from agent.event_base import Event
from agent.pipeline.event_builders import goal_positions, turns_about_z

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene
    from grounding.spec import StructureSpec
    from structdiffusion.observation import Arrangement, Scene

TRIED_PICTURE = "camera-tried"  # of a goal that was released without the arm


def release_in_physics(
    table: TableScene, scene: Scene, spec: StructureSpec, arrangement: Arrangement
) -> Generator[Event, None, None]:
    """Try a goal under the physical part of the evaluation protocol, without the arm, on a copy of the table.

    Args:
        table: where it would be built; it stays as it is.
        scene: what was seen there.
        spec: what was asked for.
        arrangement: the goal.

    Raises:
        NoValidGoal: when it does not hold.
    """
    from structdiffusion.protocol.physical_stability import place_and_check
    from structdiffusion.simulation.world import TabletopWorld

    began = time.perf_counter()
    poses = table.world.poses()
    pictures: list[np.ndarray] = []

    def photograph(world: TabletopWorld) -> None:
        pictures.append(world.picture(camera=table.world.camera))

    initial = np.array(poses[: table.count])
    there = [i for i in range(table.count, len(poses)) if table.names[i] not in table.fallen]
    verdict = place_and_check(
        table.models[: table.count],
        initial,
        arrangement.goal_from_initial,
        spec,
        table.world.table,
        [(table.models[i], poses[i]) for i in there],  # what has fallen off goes on falling
        [*table.names[: table.count], *(table.names[i] for i in there)],
        table.world.ground,
        on_end=photograph,
    )
    seconds = time.perf_counter() - began
    yield _tried_event(scene, initial, verdict.world_from_final)
    caption = "the goal as it came to rest in physics, released without the arm; the table itself is unchanged"
    yield events.Pictured(TRIED_PICTURE, caption, pictures[0])
    yield events.Checked(
        verdict.success, verdict.failure, verdict.checks, verdict.detail, "released", seconds, table.bodies
    )
    if not verdict.success:
        raise NoValidGoal(f"the best proposed goal does not hold ({verdict.failure}): {verdict.detail}")


def _tried_event(scene: Scene, initial: np.ndarray, final: np.ndarray) -> events.Tried:
    """Make the event of where released objects came to rest; poses (N, 4, 4), NaN for those never released."""
    motions = final @ np.linalg.inv(initial)
    motions[np.isnan(motions).any(axis=(1, 2))] = np.eye(4)
    return events.Tried(tuple(goal_positions(motions, scene)), turns_about_z(motions))
