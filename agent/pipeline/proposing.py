"""Propose arrangements with the planner: one step of the pipeline."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import shapely

from agent import events
from agent.errors import NotBuildable, NoValidGoal
from agent.pipeline.event_builders import goal_positions, turns_about_z

if TYPE_CHECKING:
    from structdiffusion.observation import StructureGoal, Scene
    from structdiffusion.planners.factory import Planner

CANDIDATES = 64
PREVIEWED = 3  # samples that are shown while they are denoised


def propose_arrangements(
    planner: Planner,
    model: str,
    scene: Scene,
    goal: StructureGoal,
    seed: int,
    on_preview: Callable[[events.Previewed], None] | None = None,
    count: int = CANDIDATES,
) -> events.Imagined:
    """Let the planner propose arrangements, and rank them.

    Args:
        planner: the planner.
        model: its name.
        scene: what was seen.
        goal: what is asked for.
        seed: of the samples.
        on_preview: called with the first samples while they are denoised, where the planner can show them.
        count: how many arrangements are proposed.

    Raises:
        NotBuildable: when too few objects take part, or something that has to stay stands on one of them.
        NoValidGoal: when there is no arrangement at all.
    """
    import torch

    from structdiffusion.planners.diffusion import DiffusionPlanner
    from structdiffusion.structures.structure import LayoutError

    def preview(step: int, steps: int, motions: np.ndarray) -> None:
        shown = motions[:PREVIEWED]
        positions = tuple(tuple(goal_positions(each, flat)) for each in shown)
        on_preview(events.Previewed(step, steps, positions, tuple(turns_about_z(each) for each in shown)))  # type: ignore[misc]

    began = time.perf_counter()
    _check_enough_objects(scene, goal)
    _check_nothing_on_top(scene)
    # The models were taught with objects that stand on the table; what stands on others is lowered for them.
    flat = scene.on_the_table()
    shows = on_preview is not None and isinstance(planner, DiffusionPlanner)
    more = {"preview": preview} if shows else {}
    generator = torch.Generator().manual_seed(seed)
    try:
        arrangements = planner.propose(flat, goal, count=count, generator=generator, **more)
    except LayoutError as error:
        raise NoValidGoal(f"the model {model!r} proposed no valid arrangement: {error}") from error
    lowering = np.tile(np.eye(4), (len(scene.objects), 1, 1))
    lowering[:, 2, 3] = [-cloud.bottom for cloud in scene.objects]
    arrangements = [replace(each, goal_from_initial=each.goal_from_initial @ lowering) for each in arrangements]
    candidates = tuple(
        events.Candidate(
            rank,
            dict(arrangement.scores),
            tuple(goal_positions(arrangement.goal_from_initial, scene)),
            turns_about_z(arrangement.goal_from_initial),
        )
        for rank, arrangement in enumerate(arrangements, start=1)
    )
    return events.Imagined(
        model, candidates, time.perf_counter() - began, scene=scene, arrangements=tuple(arrangements)
    )


def _check_enough_objects(scene: Scene, goal: StructureGoal) -> None:
    """Raise `NotBuildable` when fewer objects take part than the shape needs."""
    from structdiffusion.structures import STRUCTURES

    shape, count = goal.spec.shape, len(scene.objects)
    if shape is not None and count < (least := STRUCTURES[shape].least):
        raise NotBuildable(f"a {shape} needs at least {least} objects, but {count} take part")


def _check_nothing_on_top(scene: Scene) -> None:
    """Raise `NotBuildable` when a distractor stands on an object that takes part: it would fall when that is picked."""
    from agent.arm.placement_order import stands_above

    clouds = (*scene.objects, *scene.distractors)
    outlines = [shapely.MultiPoint(cloud.points[:, :2]).convex_hull for cloud in clouds]
    bottoms = [cloud.bottom for cloud in clouds]
    for upper in range(len(scene.objects), len(clouds)):
        for lower in range(len(scene.objects)):
            if stands_above(upper, lower, outlines, bottoms):
                above, below = clouds[upper].name, clouds[lower].name
                raise NotBuildable(f"the {above} stands on the {below} and would fall: let the {above} take part too")
