"""Build with the arm: the step, the choices and pictures that belong to it, and the final verdict."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Generator, Iterator, Sequence
from contextlib import nullcontext
from typing import TYPE_CHECKING

import numpy as np

from agent import events
from agent.arm.placement_rules import PlacementRules, moving
from agent.errors import ExecutionFailed, PartlyDone
from agent.event_base import Event
from agent.pipeline.build_progress import BuildProgress
from agent.pipeline.table_goal import TableGoal

if TYPE_CHECKING:
    from agent.arm.disturbances import Disturber
    from agent.arm.remainder import EndsHere, Remainder, Replanner
    from agent.recordings.trajectory_export import TrajectoryLog
    from agent.scenes.table_scene import TableScene
    from grounding.spec import StructureSpec
    from structdiffusion.observation import Arrangement, Scene

LAST_PICTURE = "camera-after"  # taken when the arm is done and what it built is about to be judged


def build_with_arm(
    table: TableScene,
    scene: Scene,
    wanted: StructureSpec | TableGoal,
    arrangements: Sequence[Arrangement],
    seed: int,
    *,
    ranks: Sequence[int] | None = None,
    film: bool = True,
    on_step: Callable[[TableScene], None] | None = None,
    on_check: Callable[[], None] | None = None,
    log: TrajectoryLog | None = None,
    disturber: Disturber | None = None,
    replanner: Replanner | None = None,
    ends_here: EndsHere | None = None,
    first: Collection[int] = (),
) -> Generator[Event, None, None]:
    """Build with the arm, take a picture after every placement, and check the result.

    Args:
        table: the table to build on.
        scene: the observation of it.
        wanted: the goal: the slots of one structure, or a goal of several parts.
        arrangements: proposed goals, best first.
        seed: the random seed of the arm's planning.
        ranks: of the arrangements, from 1; by default they are numbered in order.
        film: whether to take pictures of the arm at work too, and a film, however the build ends.
        on_step: called after every physics step while the arm is at work.
        on_check: called for every configuration that the planning of motions checks.
        log: gets every motion of the arm.
        disturber: disturbs the build.
        replanner: proposes other arrangements where something is gone or in the way while the arm builds.
        ends_here: asked before each motion of an object, and once more in the end; nothing is judged if the build ends
            so.
        first: the objects that are moved before all others.

    Raises:
        ExecutionFailed: if an object could not be placed, or the result does not stand as asked.
        PartlyDone: if it does, but objects were gone.
        KeyboardInterrupt: on an interruption, after the event `Stopped` if the arm was at work.
    """
    from agent.arm.build_listeners import BuildListeners
    from agent.arm.executor import build_structure
    from agent.pipeline.film import Film

    seen_at = table.poses()
    initial = np.array(list(seen_at.values())[: table.count])
    rng = np.random.default_rng(seed)
    several = wanted if isinstance(wanted, TableGoal) else None
    rules = (PlacementRules() if several is None else several.placement_rules(scene)).with_first(
        first, len(scene.objects)
    )
    reel = Film(table.film_camera) if film else None
    ranks = ranks or range(1, len(arrangements) + 1)
    progress = BuildProgress(table, seen_at, scene, arrangements, ranks, several, reel)
    progress.replanner = replanner

    def after_step() -> None:
        if reel is not None:
            reel.step()
        if disturber is not None:
            disturber.on_step()
        if on_step is not None:
            on_step(table)

    ended = False

    def asked(remainder: Callable[[], Remainder]) -> bool:
        nonlocal ended
        ended = ends_here is not None and ends_here(remainder)
        return ended

    listeners = BuildListeners(after_step, on_check, log, None if replanner is None else progress, asked)
    with nullcontext() if reel is None else reel:
        try:
            work: Generator[Event, None, None] = build_structure(
                table.world, table.arm, scene, arrangements, rng=rng, rules=rules, listeners=listeners
            )
            if disturber is not None:
                work = _disturbed(work, disturber)
            yield from forward_events(work, progress.with_context)
        except (Exception, KeyboardInterrupt):  # not `finally`: a generator that is closed may yield nothing more
            yield from progress.film()
            raise
        yield from progress.film()
    if ended:
        return
    motions = progress.arrangements[progress.index].goal_from_initial
    yield from _judge(table, wanted, moving(motions), motions @ initial, progress)


def forward_events(
    work: Generator[Event, None, None], more: Callable[[Event], Iterator[Event]]
) -> Generator[Event, None, None]:
    """Yield what `more` makes of each event of `work`, in turn.

    A KeyboardInterrupt that reaches a listener is thrown into `work`, which may be moving an arm: the events that it
    yields then are forwarded too, before the interruption is raised again.
    """
    event = next(work, None)
    while event is not None:
        try:
            yield from more(event)
        except KeyboardInterrupt as interruption:
            event = work.throw(interruption)
        else:
            event = next(work, None)


def _disturbed(work: Generator[Event, None, None], disturber: Disturber) -> Generator[Event, None, None]:
    """Yield the events of the arm among those that tell what disturbed it, or why nothing did."""
    yield from forward_events(work, disturber.events)
    yield from disturber.rest()
    if why_not := disturber.why_not:
        yield events.Noted(why_not)


def _judge(
    table: TableScene,
    wanted: StructureSpec | TableGoal,
    to_move: Sequence[int],
    world_from_goal: np.ndarray,
    progress: BuildProgress,
) -> Iterator[Event]:
    from agent.pipeline.verdict import STANDING, judge_built, judge_goal

    began = time.perf_counter()
    last = "the scene in the end, through the camera"
    asked = len({*to_move, *progress.lost})
    left, lost = _what_is_left(table, wanted, progress)
    gone = [table.names[index] for index in lost]
    to_move = [index for index in to_move if index not in lost]
    told = [progress.lost[index] for index in lost if index not in progress.down]
    not_placed = set(to_move) - set(progress.placed)
    if not_placed or left is None:
        yield progress.pictured(LAST_PICTURE, last)
        stand = len(set(to_move) - not_placed - progress.down.keys())
        what = "were placed" if not progress.down else "stand as placed"
        trouble = progress.trouble if not_placed else "the goal cannot hold without it" if len(gone) == 1 else ""
        raise ExecutionFailed(
            f"{stand} of {asked} objects {what}: {'; '.join(filter(None, (*told, trouble, progress.fallen)))}"
        )
    if isinstance(left, TableGoal):
        failure, checks = judge_goal(
            table.world, table.names, to_move, world_from_goal[to_move], left, progress.supports
        )
    else:
        indices = [index for index in range(table.count) if index not in lost]
        failure, checks = judge_built(table.world, indices, world_from_goal[indices], left, progress.supports)
    yield from progress.changed(to_move, world_from_goal)
    yield progress.pictured(LAST_PICTURE, last)
    detail = "everything stands as asked"
    if failed := next((check for check in checks if not check.passed), None):
        why = progress.fallen or failed.sentence
        standing = next(check for check in checks if check.name == STANDING)
        detail = why if standing.passed else f"{standing.measured:g} of {standing.limit} objects stand as placed: {why}"
    count = table.count - len(gone)
    yield events.Checked(
        failure is None, failure, checks, detail, "arm", time.perf_counter() - began, table.bodies, count,
        (*table.missing, *gone),
    )  # fmt: skip
    if failure is not None:
        what = "goal" if isinstance(wanted, TableGoal) else "structure"
        why = "; ".join((*told, detail))
        raise ExecutionFailed(f"the {what} was built but does not stand as asked ({failure}): {why}")
    if gone:
        every = count + len(table.missing) + len(gone)
        why = "; ".join(progress.lost[index] for index in lost)
        raise PartlyDone(f"{count} of {every} objects stand as asked: {why}")


def _what_is_left(
    table: TableScene, wanted: StructureSpec | TableGoal, progress: BuildProgress
) -> tuple[StructureSpec | TableGoal | None, list[int]]:
    """Return the goal without what was left out, and the indices of that.

    Where the goal cannot hold without them, objects that only lie there count as part of it. Without what is gone there
    may be no goal any more.
    """
    from structdiffusion.structures import structure_named

    lost = sorted(progress.lost)
    gone = [index for index in lost if progress.is_gone(index)]
    left: StructureSpec | TableGoal | None = None
    for these in (lost, gone):
        if isinstance(wanted, TableGoal):
            left = wanted.without([table.names[index] for index in these])
        elif wanted.shape is None or table.count - len(these) >= structure_named(wanted.shape).least:
            left = wanted
        if left is not None:
            break
    return left, these
