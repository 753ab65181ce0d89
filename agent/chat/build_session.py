"""Propose arrangements and build them on the table of a conversation."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from agent import events
from agent.arm.events import Planned
from agent.arm.fixed_objects import describe_fixed, with_fixed
from agent.arm.placement_rules import PlacementRules
from agent.chat.other_arrangement import Places, other_ranks, places_of
from agent.chat.state import Build, Proposal, Situation
from agent.chat.table_session import TableSession
from agent.chat.turn import Turn
from agent.errors import DONE, NotBuildable, NoValidGoal, PartlyDone, UsageError
from agent.event_base import Event, Listener
from agent.pipeline.building import LAST_PICTURE, build_with_arm, forward_events
from agent.pipeline.candidates import filter_viable
from agent.pipeline.event_builders import describe_aside, describe_shortfall, perceived_event
from agent.pipeline.proposing import propose_arrangements, propose_goal
from agent.pipeline.release import release_in_physics
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions, make_goal
from agent.pipeline.table_goal import TableGoal, planned_as_structure, put_on_table, with_what_is_there
from agent.scenes.limits import MOST_OBJECTS
from grounding.dialogue.state import Dialogue, built
from grounding.goals.part_numbers import still_to_build
from grounding.spec import StructureSpec
from structdiffusion.observation import Scene

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene

_STANDS = "what was built before stays as it stands"
_NO_OTHER = (
    "no arrangement that differs visibly from those shown was found; the best one is proposed again, and a looser wish "
    "leaves room for others"
)


class BuildSession(TableSession):
    """A `TableSession` with proposed arrangements, one of which can be built.

    Attributes:
        ranks: of the viable arrangements of the last proposal, those that were not shown before; all if there are none.
    """

    def __init__(self, options: RunOptions, cache: ResourceCache, listeners: Sequence[Listener]) -> None:
        super().__init__(options, cache, listeners)
        self._turn = Turn(self.send)
        self._shown: list[Places] = []  # of the present wish
        self.ranks: list[int] = []
        self._unmet: tuple[Situation, Situation] | None = None  # a wish without an arrangement, and what was before it

    # --- proposals --------------------------------------------------------------------

    def _propose(self, situation: Situation, other: bool = False) -> None:
        """Propose arrangements of a situation's wish.

        Args:
            situation: what is wanted.
            other: whether the best arrangement that differs visibly from those shown is wanted, not the best of all.
        """
        try:
            self._propose_for(situation, other)
        except BaseException as error:
            if isinstance(error, NotBuildable | NoValidGoal) and situation.goal != self.situation.goal:
                self._say(replace(self.situation.dialogue, wish=situation.goal))  # what is said next may mend it
            if isinstance(error, NoValidGoal):
                self._unmet = (self.situation, situation)
            self._look_at_pending()
            raise

    def _say(self, dialogue: Dialogue) -> None:
        """Change what was said, and nothing else."""
        self.situation = replace(self.situation, dialogue=dialogue)

    @property
    def wanted(self) -> Situation:
        """Return what is wanted: the last wish, also one that no arrangement was good enough for, unless a proposal is
        pending.
        """
        since, unmet = self._unmet or (None, self.situation)
        return unmet if since is self.situation and since.proposal is None else self.situation

    def _propose_for(self, situation: Situation, other: bool) -> None:
        self._turn.step, began = "scene", time.perf_counter()
        if self.table.tidy_up():
            self.send(events.Noted("the arm emptied its hand and folded"))
            situation = replace(situation, poses=self.table.poses())
        whole, missing = with_what_is_there(self.table, situation.goal)
        goal = still_to_build(whole, situation.dialogue.standing)
        if not goal.parts:
            raise NotBuildable("it stands already; “put it back” takes the last build back")
        if situation.dialogue.standing:
            self.send(events.Noted(_STANDS))
        situation = replace(situation, missing=missing)
        spec, wanted = goal.plain_spec, None
        if spec is not None and planned_as_structure(spec):
            taking = [self.table.original_names[index] for index in goal.named_objects()]  # type: ignore[index]
            if len(taking) > MOST_OBJECTS:
                raise NotBuildable(f"{len(taking)} objects would take part; legal: up to {MOST_OBJECTS}")
            self.table.involve(taking)
            scene = everything = with_fixed(self.table.look(), self.table.arm.hold)
        else:
            wanted, everything = put_on_table(self.table, goal)
            everything = with_fixed(everything, self.table.arm.hold)
            scene = everything.select(wanted.movable)
        self.table.missing = missing
        if shortfall := describe_shortfall(self.table, "take part"):
            self.send(events.Noted(shortfall))
        looking = time.perf_counter() - began
        self.send(perceived_event(scene, looking, self.table))
        if fixed := describe_fixed(scene):
            self.send(events.Noted(fixed))
        self._turn.step = "propose"
        options, cache = self.options, self._cache
        planner = cache.planner(options.model, options.weights, options.allow_unverified)
        networks = cache.provenance(options.model, options.weights)
        for one in networks.values():
            if not one.verified:
                self.send(events.Noted(one.card))
        if wanted is None:
            assert spec is not None  # it is planned as one structure
            asked = make_goal(spec, cache.encoder)
            proposed = propose_arrangements(planner, options.model, scene, asked, options.seed, self.send)
        else:
            proposed = self._proposed_parts(wanted, everything, looking)
        proposed = replace(proposed, networks=networks)
        self.send(proposed)
        viable = len(filter_viable(proposed.arrangements))
        if not other:
            self._shown = []
        self.ranks = other_ranks(proposed.arrangements, proposed.scene, self._shown)
        if not self.ranks:
            self.send(events.Noted(_NO_OTHER))
            self.ranks = list(range(1, viable + 1))
        rank = self.ranks[0]
        proposal = Proposal(situation.goal, wanted or spec or StructureSpec(), proposed.scene, proposed, viable, rank)
        self._remember(replace(situation, proposal=proposal, shown=proposal))
        self.show_ranks([rank])
        self.send(proposal.chosen)
        if aside := describe_aside(proposal.chosen):
            self.send(events.Noted(aside))

    def _proposed_parts(self, wanted: TableGoal, everything: Scene, looking: float) -> events.Proposed:
        """Propose arrangements for a goal of several parts; objects that it sets aside take part too.

        Args:
            wanted, everything: as returned by `put_on_table`.
            looking: duration of the perception step, seconds.
        """
        options = self.options
        planner = self._cache.goal_planner(options.model, options.weights, options.allow_unverified)
        proposed = propose_goal(planner, options.model, everything, wanted, options.seed)
        if len(proposed.scene.objects) > self.table.count:
            self.table.involve([cloud.name for cloud in proposed.scene.objects])
            self.send(perceived_event(proposed.scene, looking, self.table))
        return proposed

    def choose(self, rank: int) -> None:
        """Choose the arrangement to build.

        Raises:
            UsageError: if there is no such arrangement.
        """
        proposal = self._proposed()
        if not 1 <= rank <= len(proposal.proposed.arrangements):
            raise UsageError(f"there is no candidate {rank}; legal: 1 to {len(proposal.proposed.arrangements)}")
        proposal = replace(proposal, rank=rank)
        self.situation = replace(self.situation, proposal=proposal, shown=proposal)
        self.show_ranks([rank])
        self.send(proposal.chosen)

    def show_ranks(self, ranks: Iterable[int]) -> None:
        """Count arrangements of the proposal as shown: `again` proposes others."""
        shown = self.situation.proposal
        if shown is not None:
            self._shown += places_of([shown.proposed.arrangements[rank - 1] for rank in ranks], shown.scene)

    def again(self, seed: int | None = None) -> bool:
        """Propose another arrangement of the same wish, which differs visibly from those shown; if there is none, say
        so. Return as `say` does. An open question is asked again.

        Args:
            seed: of the new arrangements; by default the next one.

        Raises:
            UsageError: if nothing was asked for.
        """
        if self._asked_again():
            return False
        if not self.wanted.asked:
            raise UsageError("nothing was asked for yet; say what to build")
        self.options = replace(self.options, seed=self.options.seed + 1 if seed is None else seed)
        with self._turn.part("scene"):
            self._propose(replace(self.wanted, poses=self.table.poses()), other=True)
            return True
        return False

    def _asked_again(self) -> bool:
        """Ask the open question again. Return whether there is one."""
        if self.question is None:
            return False
        self.send(events.Asked(self.question.slot, self.question.text, self.question.options))
        return True

    def resume(self) -> bool:
        """Propose the last request again on the present table, if it is not built yet. Return as `say` does."""
        if self._asked_again():
            return False
        if not self.situation.asked:
            raise UsageError("nothing was asked for yet; say what to build")
        if self.situation.built:
            raise UsageError("it already stands as asked; say what to change, or what to build next")
        self._turn.begin()
        with self._turn.part("scene"):
            self._propose(replace(self.situation, poses=self.table.poses()))
            return True
        return False

    def _proposed(self) -> Proposal:
        proposal = self.situation.proposal
        if proposal is None:
            raise UsageError("there is no proposal; say what to build, or /again")
        return proposal

    def _go_to(self, how: str, situation: Situation | None) -> None:
        super()._go_to(how, situation)
        self._look_at_pending()

    def _look_at_pending(self) -> None:
        """Let the table and all listeners turn to the objects of the pending proposal, which can be built now."""
        if (pending := self.situation.proposal) is not None:
            self.table.involve([cloud.name for cloud in pending.scene.objects])
            self.table.missing = self.situation.missing
            self.send(perceived_event(pending.scene, 0.0, self.table))

    # --- building -----------------------------------------------------------------------

    def plan(self) -> None:
        """Plan the chosen arrangement and send the events of the plan, without moving anything."""
        from agent.arm.plan_selection import plan_structure

        proposal = self._proposed()
        rng = np.random.default_rng(self.options.seed)
        kinematics, hold = self.table.arm.kinematics, self.table.arm.hold
        several = proposal.several
        rules = PlacementRules() if several is None else several.placement_rules(proposal.scene)
        arrangements = proposal.arrangements_to_try[:1]
        for event in plan_structure(proposal.scene, arrangements, rng=rng, kinematics=kinematics, rules=rules, hold=hold):
            self.send(replace(event, arrangement=proposal.rank - 1))

    def go(
        self, on_step: Callable[[TableScene], None] | None = None, on_check: Callable[[], None] | None = None
    ) -> bool:
        """Build the chosen arrangement and check it. Return whether it stands as asked.

        Args:
            on_step: called after every physics step while the arm is at work; a `KeyboardInterrupt` that it raises
                stops the arm.
            on_check: called often while motions are planned; a `KeyboardInterrupt` that it raises ends the search.
        """
        from agent.scenes.table_scene import MOVED

        proposal, options = self._proposed(), self.options
        done, before = False, self.table.poses()
        self._history.forget_undone()
        try:
            with self._turn.part("build"):
                arrangements = proposal.arrangements_to_try
                if options.execute:
                    building = build_with_arm(
                        self.table,
                        proposal.scene,
                        proposal.wanted,
                        arrangements,
                        options.seed,
                        ranks=proposal.ranks_to_try,
                        on_step=on_step,
                        on_check=on_check,
                    )
                else:
                    building = release_in_physics(self.table, proposal.scene, proposal.wanted, arrangements[0])
                for _ in forward_events(building, self._watched):
                    pass
                if shortfall := describe_shortfall(self.table, "stand as asked"):
                    raise PartlyDone(shortfall)
                done = True
        finally:
            poses, now = self.table.poses(), self.situation
            moved = tuple(name for name, pose in poses.items() if np.abs(pose - before[name]).max() > MOVED)
            stood = tuple(now.goal.parts[number] for number in sorted(now.dialogue.standing))
            build = Build(now.goal, now.names, before, moved, "" if done else self._turn.trouble, stood)
            said = built(now.dialogue) if done and moved else now.dialogue
            self.situation = replace(now, dialogue=said, poses=poses, proposal=None, builds=(*now.builds, build))
        if done:
            self.send(events.Finished(True, DONE, self._turn.seconds))
        return done

    def _watched(self, event: Event) -> Iterator[Event]:
        if isinstance(event, Planned) and self.situation.shown is not None:  # it need not be the one that was chosen
            self.situation = replace(self.situation, shown=replace(self.situation.shown, rank=event.arrangement + 1))
        if isinstance(event, events.Pictured) and event.name == LAST_PICTURE:
            self._turn.step = "check"
        self.send(event)
        yield event
