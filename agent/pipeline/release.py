"""Try a goal in physics without the arm: one step of the pipeline."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from agent import events
from agent.arm.placement_rules import moving
from agent.errors import NoValidGoal
from agent.event_base import Event
from agent.pipeline.event_builders import goal_positions, turns_about_z
from agent.pipeline.table_goal import TableGoal

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene
    from grounding.spec import StructureSpec
    from structdiffusion.observation import Arrangement, Scene
    from structdiffusion.protocol.physical_stability import Verdict
    from structdiffusion.simulation.world import TabletopWorld

TRIED_PICTURE = "camera-tried"  # of a goal that was released without the arm


def release_in_physics(
    table: TableScene, scene: Scene, wanted: StructureSpec | TableGoal, arrangement: Arrangement
) -> Generator[Event, None, None]:
    """Try a goal under the physical part of the evaluation protocol, without the arm, on a copy of the table.

    Args:
        table: the table, which is not changed.
        scene: the observation of it.
        wanted: the goal: the slots of one structure, or a goal of several parts.
        arrangement: the goal.

    Raises:
        NoValidGoal: if it does not hold.
    """
    began = time.perf_counter()
    pictures: list[np.ndarray] = []

    def photograph(world: TabletopWorld) -> None:
        pictures.append(world.picture(camera=table.world.camera))

    verdict = _placed(table, wanted, arrangement, photograph)
    final = verdict.world_from_final
    assert final is not None
    seconds = time.perf_counter() - began
    motions = _motions(np.array(table.world.poses()[: table.count]), final)
    yield events.Tried(tuple(goal_positions(motions, scene)), turns_about_z(motions))
    caption = "the goal as it came to rest in physics, released without the arm; the table itself is unchanged"
    moved = dict(zip(table.names[: table.count], motions, strict=True))
    yield events.Pictured(TRIED_PICTURE, caption, pictures[0], moved)
    yield events.Checked(
        verdict.success, verdict.failure, verdict.checks, verdict.detail, "released", seconds, table.bodies,
        table.count,
        tuple(table.missing),
    )  # fmt: skip
    if not verdict.success:
        raise NoValidGoal(f"the best proposed goal does not hold ({verdict.failure}): {verdict.detail}")


def _placed(
    table: TableScene,
    wanted: StructureSpec | TableGoal,
    arrangement: Arrangement,
    on_end: Callable[[TabletopWorld], None],
) -> Verdict:
    """Release an arrangement in a separate world; the verdict's poses are those of the participants."""
    from structdiffusion.protocol.physical_stability import place_and_check
    from structdiffusion.protocol.release import Release, TabletopBodies

    world, count = table.world, table.count
    poses, release = world.poses(), Release(on_end=on_end)
    if not isinstance(wanted, TableGoal):
        # What has fallen off goes on falling.
        others = [i for i in range(count, len(poses)) if table.names[i] not in table.fallen]
        bodies = TabletopBodies(
            table.models[:count],
            np.array(poses[:count]),
            world.table,
            [(table.models[i], poses[i]) for i in others],
            [*table.names[:count], *(table.names[i] for i in others)],
            world.ground,
            held=[k for k, i in enumerate((*range(count), *others)) if i in world.held],
        )
        return place_and_check(bodies, arrangement.goal_from_initial, wanted, release=release)
    place = {name: i for i, name in enumerate(table.names)}
    indices, unseen = [place[name] for name in wanted.names], [place[name] for name in wanted.unseen]
    motions = np.tile(np.eye(4), (len(poses), 1, 1))
    motions[:count] = arrangement.goal_from_initial
    bodies = TabletopBodies(
        [table.models[i] for i in indices],
        np.array([poses[i] for i in indices]),
        world.table,
        [(table.models[i], poses[i]) for i in unseen],
        wanted.all_names,
        world.ground,
        held=[k for k, i in enumerate((*indices, *unseen)) if i in world.held],
        colors=wanted.colors,
    )
    release = replace(release, order=tuple(indices.index(i) for i in arrangement.order))
    aside = wanted.set_aside([table.names[i] for i in moving(motions)])
    verdict = place_and_check(bodies, motions[indices], wanted.goal, aside, release)
    final = verdict.world_from_final
    assert final is not None
    return replace(verdict, world_from_final=final[[indices.index(i) for i in range(count)]])


def _motions(initial: np.ndarray, final: np.ndarray) -> np.ndarray:
    """Return how released objects moved (N, 4, 4); their final poses (N, 4, 4) are NaN if they were never released."""
    motions = final @ np.linalg.inv(initial)
    motions[np.isnan(motions).any(axis=(1, 2))] = np.eye(4)
    return motions
