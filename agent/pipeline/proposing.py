"""Propose arrangements with the planner: one step of the pipeline."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import shapely

from agent import events
from agent.errors import NotBuildable, NoValidGoal
from agent.pipeline.candidates import what_fits
from agent.pipeline.event_builders import goal_positions, turns_about_z
from structdiffusion.observation import Arrangement

if TYPE_CHECKING:
    from agent.pipeline.table_goal import TableGoal
    from grounding.parsers.sentence_encoder import SentenceEncoder
    from grounding.spec import StructureSpec
    from structdiffusion.observation import ObjectCloud, Scene, StructureGoal
    from structdiffusion.planners.factory import Planner
    from structdiffusion.planners.goal_planner import GoalPlanner

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
) -> events.Proposed:
    """Let the planner propose arrangements, and rank them.

    Args:
        planner: the planner.
        model: its name.
        scene: the observation.
        goal: the goal.
        seed: of the samples.
        on_preview: called with the first samples during denoising, if the planner supports it.
        count: how many arrangements are proposed.

    Raises:
        NotBuildable: if too few objects take part, or something that has to stay stands on one of them.
        NoValidGoal: if there is no arrangement at all.
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
        instead = what_fits(flat, goal.spec)
        raise NoValidGoal(f"the model {model!r} proposed no valid arrangement: {error}{instead}") from error
    lowering = np.tile(np.eye(4), (len(scene.objects), 1, 1))
    lowering[:, 2, 3] = [-cloud.bottom for cloud in scene.objects]
    arrangements = [replace(each, goal_from_initial=each.goal_from_initial @ lowering) for each in arrangements]
    return proposed_event(model, scene, arrangements, time.perf_counter() - began)


def propose_goal(
    planner: GoalPlanner, model: str, scene: Scene, wanted: TableGoal, seed: int, count: int = CANDIDATES
) -> events.Proposed:
    """Let the planner propose arrangements for a goal of several parts, and rank them.

    Args:
        planner: the planner.
        model: its name.
        scene: what was seen, all of it as objects, in the order of the goal's indices.
        wanted: the goal.
        seed: of the samples.
        count: how many arrangements are proposed.

    Returns:
        The arrangements, for those objects that the goal places or that any arrangement sets aside: they are the
            objects
        of its scene, and all others its distractors. An object that stays in an arrangement has the identity as motion.

    Raises:
        NotBuildable: if an object that has to stay stands on one that has to move.
        NoValidGoal: if there is no arrangement at all.
    """
    import torch

    from structdiffusion.structures.structure import LayoutError

    began = time.perf_counter()
    generator = torch.Generator().manual_seed(seed)
    try:
        found = planner.propose(scene, wanted.goal, count=count, generator=generator, colors=wanted.colors or None)
    except LayoutError as error:
        raise NoValidGoal(f"the model {model!r} proposed no valid arrangement: {error}") from error
    # To make room, nothing is moved on which something stands that stays; if it has to be, the check below says so.
    carried = _carried(scene.objects)
    free = [
        each
        for each in found
        if not any(low in each.moved and up not in {*each.moved, *wanted.movable} for up, low in carried)
    ]
    found = free or found
    touched = sorted({*wanted.movable, *(index for each in found for index in each.moved)})
    part = scene.select(touched)
    _check_nothing_on_top(part)
    arrangements = [
        Arrangement(
            each.goal_from_initial[touched],
            dict(each.scores),
            order=tuple(touched.index(index) for index in each.order),
        )
        for each in found
    ]
    return proposed_event(model, part, arrangements, time.perf_counter() - began)


def make_goal(spec: StructureSpec, encoder: SentenceEncoder) -> StructureGoal:
    """Make the goal of a planner from slots, with a sentence in the words that sentence models were trained on.

    People say the same in ways that move its embedding far: after "facing me" such a model left no ring open.

    Args:
        spec: the slots, in the world's frame.
        encoder: embeds the sentence.
    """
    from grounding.corpus.grammar import sentences
    from structdiffusion.observation import StructureGoal

    words = sentences(spec)[0]
    return StructureGoal(spec, words, encoder.encode([words])[0])


def proposed_event(model: str, scene: Scene, arrangements: Sequence[Arrangement], seconds: float) -> events.Proposed:
    """Make the event of arrangements, best first, for the objects of a scene."""
    candidates = tuple(
        events.Candidate(
            rank,
            dict(arrangement.scores),
            tuple(goal_positions(arrangement.goal_from_initial, scene)),
            turns_about_z(arrangement.goal_from_initial),
        )
        for rank, arrangement in enumerate(arrangements, start=1)
    )
    return events.Proposed(model, candidates, seconds, scene=scene, arrangements=tuple(arrangements))


def _check_enough_objects(scene: Scene, goal: StructureGoal) -> None:
    """Raise `NotBuildable` when fewer objects take part than the shape needs."""
    from structdiffusion.structures import structure_named

    shape, count = goal.spec.shape, len(scene.objects)
    if shape is not None and count < (least := structure_named(shape).least):
        raise NotBuildable(f"a {shape} needs at least {least} objects, but {count} take part")


def _check_nothing_on_top(scene: Scene) -> None:
    """Raise `NotBuildable` when a distractor stands on an object that takes part: it would fall when that is picked."""
    clouds, count = (*scene.objects, *scene.distractors), len(scene.objects)
    for upper, lower in _carried(clouds):
        if lower < count <= upper:
            above, below = clouds[upper].name, clouds[lower].name
            raise NotBuildable(f"the {above} stands on the {below} and would fall: let the {above} take part too")


def _carried(clouds: Sequence[ObjectCloud]) -> list[tuple[int, int]]:
    """Return which objects stand on which others: pairs of indices, the upper one first."""
    from structdiffusion.footprints import stands_above

    outlines = [shapely.MultiPoint(cloud.points[:, :2]).convex_hull for cloud in clouds]
    bottoms = [cloud.bottom for cloud in clouds]
    every = range(len(clouds))
    return [(up, low) for up in every for low in every if up != low and stands_above(up, low, outlines, bottoms)]
