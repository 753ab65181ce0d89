"""Build on the table of a conversation, and turn to something else while the arm builds."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterator, Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from agent import events
from agent.arm.events import Planned
from agent.arm.placement_rules import PlacementRules
from agent.arm.remainder import Remainder
from agent.chat.proposal_session import ProposalSession
from agent.chat.state import Build, Situation
from agent.chat.table_facts import join_words, with_article
from agent.chat.turn import STOPPED
from agent.errors import DONE, ExecutionFailed, NotBuildable, NoValidGoal, PartlyDone
from agent.event_base import Event, json_value
from agent.pipeline.building import LAST_PICTURE, build_with_arm, forward_events
from agent.pipeline.event_builders import describe_shortfall
from agent.pipeline.laying_out import layouts_of
from agent.pipeline.release import release_in_physics
from grounding.dialogue.state import Dialogue, built
from grounding.goals.goal import Goal
from grounding.goals.parts import Part, PartReference, StructurePart

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene


class Steers(Protocol):
    """Whoever takes what is said while the arm builds: `agent.chat.steering.Steering`.

    Attributes:
        progress: what the arm is doing, in sentences.
        first: the names of the objects that are moved before all others.
        built: what was wanted of the build so far.
        line: that wants something else; empty if none does.
        turn: what is wanted in its place: the situation with its proposal, and the events that tell of it; `None` as
            long as the build goes on.
    """

    first: tuple[str, ...]
    built: Dialogue
    turn: tuple[Situation, Sequence[Event]] | None

    @property
    def progress(self) -> str: ...

    @property
    def line(self) -> str: ...

    def understood(self, situation: Situation, seconds: float) -> events.Parsed:
        """Return the event of what the line was understood as."""

    def poll(self) -> None:
        """Take what was said by now; a `KeyboardInterrupt` stops the arm."""

    def follow(self, event: Event) -> None:
        """Take an event of the build."""

    def ends_here(self, remainder: Callable[[], Remainder]) -> bool:
        """Return whether the build ends at a safe point, as `agent.arm.remainder.EndsHere`."""

    def begin(self) -> None:
        """Take what is proposed now as what is built from here on."""


class BuildSession(ProposalSession):
    """A `ProposalSession` whose proposal can be built."""

    _steering: Steers | None = None  # while the arm builds
    _is_planned = False  # whether the arm had a plan for the last build

    def plan(self) -> None:
        """Plan the chosen arrangement and send the events of the plan, without moving anything."""
        from agent.arm.plan_selection import plan_structure

        proposal = self._proposed()
        rng = np.random.default_rng(self.options.seed)
        kinematics, hold = self.table.arm.kinematics, self.table.arm.hold
        several = proposal.several
        rules = PlacementRules() if several is None else several.placement_rules(proposal.scene)
        arrangements = proposal.arrangements_to_try[:1]
        planning: Iterator[Any] = plan_structure(
            proposal.scene, arrangements, rng=rng, kinematics=kinematics, rules=rules, hold=hold
        )
        for event in planning:
            self.send(replace(event, arrangement=proposal.rank - 1))

    def go(
        self,
        on_step: Callable[[TableScene], None] | None = None,
        on_check: Callable[[], None] | None = None,
        steering: Steers | None = None,
    ) -> bool:
        """Build the chosen arrangement and check it. Return whether what is wanted in the end stands as asked.

        Args:
            on_step: called after every physics step while the arm is at work; a `KeyboardInterrupt` that it raises
                stops the arm.
            on_check: called often while motions are planned; a `KeyboardInterrupt` that it raises ends the search.
            steering: takes what is said meanwhile; what it changes is built too.
        """
        from agent.scenes.table_scene import MOVED

        self._proposed()
        done, before, now = False, self.table.poses(), self.situation
        stood = tuple(now.goal.parts[number] for number in sorted(now.dialogue.standing))
        self._history.forget_undone()
        self._steering = steering
        try:
            done = self._build(on_step, on_check)
            while steering is not None and self._turn_to(steering):
                done = self._build(on_step, on_check)
        finally:
            self._steering = None
            poses, now = self.table.poses(), self.situation
            moved = tuple(name for name, pose in poses.items() if np.abs(pose - before[name]).max() > MOVED)
            build = Build(now.goal, now.names, before, moved, "" if done else self._turn.trouble, stood)
            said = built(now.dialogue) if done and moved else now.dialogue
            self.situation = replace(now, dialogue=said, poses=poses, proposal=None, builds=(*now.builds, build))
        if done:
            self.send(events.Finished(True, DONE, self._turn.seconds))
        return done

    def _build(self, on_step: Callable[[TableScene], None] | None, on_check: Callable[[], None] | None) -> bool:
        """Build the proposal until it stands or something else is wanted; return whether it stands."""
        proposal, steering = self._proposed(), self._steering

        def after_step(table: TableScene) -> None:
            if steering is not None:
                steering.poll()
            if on_step is not None:
                on_step(table)

        def at_check() -> None:
            if steering is not None:
                steering.poll()
            if on_check is not None:
                on_check()

        with self._turn.part("build"):
            if not self.options.execute:
                self._forward(
                    release_in_physics(self.table, proposal.scene, proposal.wanted, proposal.arrangements_to_try[0])
                )
            else:
                names = [cloud.name for cloud in proposal.scene.objects]
                first = () if steering is None else [names.index(one) for one in steering.first if one in names]
                try:
                    self._forward(self._building(after_step, at_check, first))
                except ExecutionFailed:
                    if not first or self._is_planned:
                        raise
                    told = join_words([with_article(names[index]) for index in first])
                    self.send(events.Noted(f"no way was found to move {told} first, so the order is left open"))
                    self._forward(self._building(after_step, at_check, ()))
            if steering is not None and steering.turn is not None:
                return False
            if shortfall := describe_shortfall(self.table, "stand as asked"):
                raise PartlyDone(shortfall)
            return True
        return False

    def _building(
        self, on_step: Callable[[TableScene], None], on_check: Callable[[], None], first: Collection[int]
    ) -> Generator[Event, None, None]:
        """Build the proposal with the arm, these objects first; yield the events."""
        proposal, self._is_planned = self._proposed(), False
        return build_with_arm(
            self.table,
            proposal.scene,
            proposal.wanted,
            proposal.arrangements_to_try,
            self.options.seed,
            ranks=proposal.ranks_to_try,
            on_step=on_step,
            on_check=on_check,
            replanner=layouts_of(proposal.wanted, self._arranged),
            ends_here=None if self._steering is None else self._steering.ends_here,
            first=first,
        )

    def _forward(self, building: Generator[Event, None, None]) -> None:
        """Tell all events of a build."""
        for _ in forward_events(building, self._watched):
            pass

    def _turn_to(self, steering: Steers) -> bool:
        """Begin the next turn with what was said while the arm was building; return whether there is such a turn."""
        if not steering.line or (steering.turn is None and self._turn.trouble == STOPPED):
            return False
        line, said, turn = steering.line, self.situation.dialogue, steering.turn
        if turn is not None:  # of a build that failed before it came to a safe point, this was told
            self.send(events.Finished(False, DONE, self._turn.seconds))
        self._turn.begin()
        self.send(events.Started(line, json_value(asdict(self.options))))
        self.situation = replace(self.situation, dialogue=steering.built, poses=self.table.poses(), proposal=None)
        if turn is not None:
            situation, told = turn
            for event in told:
                self.send(event)
            self._offer(situation)
        else:
            with self._turn.part("scene"):
                wanting = self._wanting(said)
                self.send(steering.understood(wanting, 0.0))
                self._propose(wanting)
        if self.situation.proposal is None:
            return False
        steering.begin()
        return True

    def proposed_around(self, left: Remainder, built: Dialogue) -> tuple[Situation, list[Event]]:
        """Propose what is wanted by now around what stands of a build that ends for it; nothing is sent or remembered.

        Args:
            left: what is left of the build.
            built: what was wanted of it.

        Returns:
            The situation with the proposal, and the events that tell of it.

        Raises:
            AgentError, SceneError, ObservationError: if it cannot be had; the table is as before.
        """
        told, taking, missing = list[Event](), self.table.names[: self.table.count], self.table.missing
        said = self.situation.dialogue
        standing = {left.first.objects[index].name for index in left.standing}
        done = [part for part in built.goal.parts if self._holds(part, built.goal, left, standing)]
        stand = said.standing | {number for number, part in enumerate(said.goal.parts) if part in done}
        self._shown = []
        try:
            try:
                situation = self._wanting(replace(said, standing=stand))
                return self._planned(situation, told.append, left, built.goal), told
            except (NotBuildable, NoValidGoal):
                if stand == said.standing:
                    raise
            told.clear()  # what stands is in the way: it may be moved
            return self._planned(self._wanting(said), told.append, left, built.goal), told
        except BaseException:
            self.table.involve(taking)
            self.table.missing = missing
            raise

    def _holds(self, part: Part, goal: Goal, left: Remainder, standing: Collection[str]) -> bool:
        """Return whether all that a part of a goal names stands, as far as the build moves it."""
        moved, names = {cloud.name for cloud in left.first.objects}, self.situation.names
        second = part.around if isinstance(part, StructurePart) else part.reference
        named = set[str]()
        for meant in (part.objects, second):
            objects: Any = goal.parts[meant.part].objects if isinstance(meant, PartReference) else meant
            named |= {names[index] for index in objects or ()}
        if part.objects is None:
            named |= moved
        return bool(named.intersection(standing)) and named & moved <= set(standing)

    def _watched(self, event: Event) -> Iterator[Event]:
        self._is_planned = self._is_planned or isinstance(event, Planned)
        if isinstance(event, Planned) and self.situation.shown is not None:  # it need not be the one that was chosen
            self.situation = replace(self.situation, shown=replace(self.situation.shown, rank=event.arrangement + 1))
        if isinstance(event, events.Pictured) and event.name == LAST_PICTURE:
            self._turn.step = "check"
        if self._steering is not None:
            self._steering.follow(event)
        self.send(event)
        yield event
