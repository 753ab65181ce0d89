"""Follow the arm while it builds: what it has placed, what stands, what is lost, and pictures of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from agent import events
from agent.arm.events import Disturbed, Noticed, Picked, Placed, PlaceFailed, PlanFailed, Planned, StandingChanged
from agent.event_base import Event
from agent.pipeline.event_builders import chosen_event, describe_aside

if TYPE_CHECKING:
    from agent.arm.remainder import Remainder, Replanner
    from agent.pipeline.film import Film
    from agent.pipeline.table_goal import TableGoal
    from agent.scenes.table_scene import TableScene
    from structdiffusion.observation import Arrangement, Scene

_GONE = "is gone"


class BuildProgress:
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

    def missed(self, remainder: Remainder) -> Sequence[str]:
        """Say which checks of the goal fail where things are, as far as was seen."""
        return () if self.replanner is None else self.replanner.missed(remainder)

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
        """Yield which of the moved objects stand otherwise than when the arm was done, against goals (N, 4, 4)."""
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
        if isinstance(event, Disturbed):
            yield self.pictured("placement-disturbed", f"after the disturbance: {event.name} {event.detail}")
        if isinstance(event, Placed) and not event.aside:
            number = len(self.placed)
            caption = f"after placement {number}: {event.name}"
            yield self.pictured(f"placement-{number}-after", caption)

    def film(self) -> Iterator[Event]:
        """Yield the film of the build so far, if the arm has moved."""
        reel = self._reel
        filmed = None if reel is None else reel.finish()
        if reel is not None and filmed is not None:
            motions = {name: poses @ self._from_seen[name] for name, poses in filmed.motions.items()}
            yield replace(filmed, motions=motions, shapes=self._table.film_camera.shapes)
            if reel.trouble:
                yield events.Noted(f"there are no pictures of the arm at work: {reel.trouble}")

    def pictured(self, name: str, caption: str) -> events.Pictured:
        """Take a picture of the table as it is now, and measure how far everything has moved."""
        motions = {known: pose @ self._from_seen[known] for known, pose in self._table.poses().items()}
        return events.Pictured(name, caption, self._table.picture(), motions)
