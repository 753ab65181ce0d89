"""Build with the arm: the step, the choices and pictures that belong to it, and the final verdict."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from agent import events
from agent.arm.events import Noticed, Picked, Placed, PlaceFailed, PlanFailed, Planned, StandingChanged
from agent.arm.placement_rules import PlacementRules, moving
from agent.errors import ExecutionFailed, PartlyDone
from agent.event_base import Event
from agent.pipeline.event_builders import chosen_event, describe_aside
from agent.pipeline.table_goal import TableGoal

if TYPE_CHECKING:
    from agent.arm.remainder import Remainder, Replanner
    from agent.pipeline.film import Film
    from agent.recordings.trajectory_export import TrajectoryLog
    from agent.scenes.table_scene import TableScene
    from grounding.spec import StructureSpec
    from structdiffusion.observation import Arrangement, Scene

_GONE = "is gone"
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
    replanner: Replanner | None = None,
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
        replanner: proposes other arrangements where something is gone or in the way while the arm builds.

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
    rules = PlacementRules() if several is None else several.placement_rules(scene)
    reel = Film(table.film_camera) if film else None
    ranks = ranks or range(1, len(arrangements) + 1)
    progress = _BuildProgress(table, seen_at, scene, arrangements, ranks, several, reel)
    progress.replanner = replanner

    def after_step() -> None:
        if reel is not None:
            reel.step()
        if on_step is not None:
            on_step(table)

    listeners = BuildListeners(after_step, on_check, log, None if replanner is None else progress)
    with nullcontext() if reel is None else reel:
        try:
            work = build_structure(
                table.world, table.arm, scene, arrangements, rng=rng, rules=rules, listeners=listeners
            )
            yield from forward_events(work, progress.with_context)
        except (Exception, KeyboardInterrupt):  # not `finally`: a generator that is closed may yield nothing more
            yield from progress.film()
            raise
        yield from progress.film()
    motions = progress.arrangements[progress.index].goal_from_initial
    yield from _judge(table, wanted, moving(motions), motions @ initial, progress)


class _BuildProgress:
    """Follows the arm: adds the choice of an arrangement and the pictures to its events.

    Attributes:
        arrangements: those that were proposed, then those that were laid out anew.
        replanner: whom to ask for these.
        lost: object -> why it is left out of what is built, in a sentence.
        index: of the arrangement that is being built.
        placed: the indices of the objects that were placed; one that was pushed away may be placed twice.
        down: object -> what happened to one that was placed and does not stand as placed, in a sentence.
        supports: object -> the one, or `TABLE`, that it was to rest on, of those that were placed.
        trouble: why something could not be placed, in a sentence.
    """

    def __init__(
        self,
        table: TableScene,
        seen_at: Mapping[str, np.ndarray],
        scene: Scene,
        arrangements: Sequence[Arrangement],
        ranks: Sequence[int],
        wanted: TableGoal | None,
        reel: Film | None,
    ) -> None:
        self._reel = reel
        self._table, self._scene = table, scene
        self.arrangements, self._ranks = list(arrangements), list(ranks)
        self.replanner: Replanner | None = None
        self.lost: dict[int, str] = {}
        self._wanted = wanted
        self._from_seen = {name: np.linalg.inv(pose) for name, pose in seen_at.items()}
        self.index, self.trouble = 0, "no arrangement could be planned"
        self.placed: list[int] = []
        self.down: dict[int, str] = {}
        self.supports: dict[int, int | None] = {}

    def concerns(self, name: str) -> bool:
        """Return whether the goal speaks of something that takes no part."""
        return self.replanner is not None and self.replanner.concerns(name)

    def lay_out(self, remainder: Remainder) -> Sequence[Arrangement]:
        """Propose other arrangements, and number them after those that there are."""
        proposed = [] if self.replanner is None else list(self.replanner.lay_out(remainder))
        self.arrangements += proposed
        self._ranks += range(max(self._ranks) + 1, max(self._ranks) + 1 + len(proposed))
        return proposed

    def _follow(self, event: Event) -> None:
        """Keep count of what was placed and stands."""
        match event:
            case PlaceFailed():
                self.trouble = f"{event.name} could not be placed: {event.reason}"
            case Placed():
                self.down.pop(event.object, None)
                self.supports[event.object] = self._index_of(event.on)
                if event.trouble:
                    self.down[event.object] = f"{event.name} {event.trouble} since it was placed"
                if not event.aside:
                    self.placed.append(event.object)
            case Noticed(what="gone" | "fallen", action="leave out" | "lay out anew", object=int(index)):
                self.lost[index] = f"{event.name} {_GONE if event.what == 'gone' else 'lies on its side'}"
            case Noticed(what="appeared", object=int(index)):
                self.lost.pop(index, None)
            case StandingChanged(stands=True):
                self.down.pop(event.object, None)
            case StandingChanged():
                self.down[event.object] = f"{event.name} {event.trouble} since {event.during}"

    def is_gone(self, index: int) -> bool:
        """Return whether an object that is left out is not on the table any more."""
        return self.lost[index].endswith(_GONE)

    def _index_of(self, support: str) -> int | None:
        """Return what an object rests on, as the world counts it; `None` where it is not known."""
        from structdiffusion.simulation.world import TABLE

        if support == "the table":
            return TABLE
        return self._table.names.index(support) if support else None

    def changed(self, moved: Sequence[int], world_from_goal: np.ndarray) -> Iterator[StandingChanged]:
        """Yield which of the moved objects stand otherwise than when the arm was done, against their goals (N, 4, 4)."""
        from structdiffusion.protocol.standing import standing, support_name

        for index in moved:
            support = self.supports.get(index)
            way = standing(self._table.world, index, world_from_goal[index], support)
            if way.stands == (index in self.down):
                trouble = way.trouble(support_name(support, self._table.names))
                event = StandingChanged(index, self._table.names[index], way.stands, trouble, "the arm was done")
                self._follow(event)
                yield event

    @property
    def fallen(self) -> str:
        """Say what was placed and does not stand, one after another; empty if everything does."""
        return "; ".join(self.down.values())

    def with_context(self, event: Event) -> Iterator[Event]:
        """Yield an event of the arm, with the choice before it and the picture after it."""
        if isinstance(event, Planned) and event.arrangement != self.index:
            self.index = event.arrangement
            chosen = chosen_event(self._ranks[self.index], self.arrangements[self.index], self._scene, self._wanted)
            yield chosen
            if aside := describe_aside(chosen):
                yield events.Noted(aside)
        if isinstance(event, Planned | PlanFailed):
            event = replace(event, arrangement=self._ranks[event.arrangement] - 1)
        yield event
        self._follow(event)
        if isinstance(event, Picked) and self._reel is not None and (picture := self._reel.draw()) is not None:
            yield events.Pictured(f"placement-{len(self.placed) + 1}-picked", f"{event.name} in the hand", picture)
        if isinstance(event, Placed) and not event.aside:
            number = len(self.placed)
            caption = f"after placement {number}: {event.name}"
            yield self.pictured(f"placement-{number}-after", caption)

    def film(self) -> Iterator[Event]:
        """Yield the film of the build so far, if the arm has moved."""
        filmed = None if self._reel is None else self._reel.finish()
        if filmed is not None:
            motions = {name: poses @ self._from_seen[name] for name, poses in filmed.motions.items()}
            yield replace(filmed, motions=motions, shapes=self._table.film_camera.shapes)
            if self._reel.trouble:
                yield events.Noted(f"there are no pictures of the arm at work: {self._reel.trouble}")

    def pictured(self, name: str, caption: str) -> events.Pictured:
        """Take a picture of the table as it is now, and measure how far everything has moved."""
        motions = {known: pose @ self._from_seen[known] for known, pose in self._table.poses().items()}
        return events.Pictured(name, caption, self._table.picture(), motions)


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


def _judge(
    table: TableScene,
    wanted: StructureSpec | TableGoal,
    to_move: Sequence[int],
    world_from_goal: np.ndarray,
    progress: _BuildProgress,
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
        why = progress.fallen or f"{failed.name}: {failed.measured:.3g}, allowed {failed.limit}"
        stand = next(check for check in checks if check.name == STANDING)
        detail = why if stand.passed else f"{stand.measured:g} of {stand.limit} objects stand as placed: {why}"
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
        raise PartlyDone(f"{count} of {every} objects stand as asked: {'; '.join(progress.lost[index] for index in lost)}")


def _what_is_left(
    table: TableScene, wanted: StructureSpec | TableGoal, progress: _BuildProgress
) -> tuple[StructureSpec | TableGoal | None, list[int]]:
    """Return the goal without what was left out, and the indices of that.

    Where the goal cannot hold without them, objects that only lie there count as part of it. Without what is gone there
    may be no goal any more.
    """
    from structdiffusion.structures import STRUCTURES

    lost = sorted(progress.lost)
    gone = [index for index in lost if progress.is_gone(index)]
    left: StructureSpec | TableGoal | None = None
    for these in (lost, gone):
        if isinstance(wanted, TableGoal):
            left = wanted.without([table.names[index] for index in these])
        elif wanted.shape is None or table.count - len(these) >= STRUCTURES[wanted.shape].least:
            left = wanted
        if left is not None:
            break
    return left, these
