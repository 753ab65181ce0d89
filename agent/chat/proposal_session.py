"""Propose arrangements on the table of a conversation."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from agent import events
from agent.arm.fixed_objects import describe_fixed, with_fixed
from agent.arm.remainder import Remainder
from agent.chat.other_arrangement import Places, other_ranks, places_of
from agent.chat.state import Proposal, Situation
from agent.chat.table_session import TableSession
from agent.chat.turn import Turn
from agent.errors import NotBuildable, NoValidGoal, UsageError
from agent.event_base import Event, Listener
from agent.pipeline.candidates import filter_viable
from agent.pipeline.copy_sizes import describe_sizes
from agent.pipeline.event_builders import describe_aside, describe_shortfall, perceived_event
from agent.pipeline.proposing import make_goal, propose_arrangements, propose_goal, proposed_event
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from agent.pipeline.table_goal import (
    TableGoal,
    described_parts,
    planned_as_structure,
    put_on_table,
    with_what_is_there,
)
from agent.pipeline.turning import carried_over, laid_around
from agent.scenes.limits import MOST_OBJECTS
from grounding.dialogue.state import Dialogue
from grounding.goals.goal import Goal
from grounding.goals.part_numbers import still_to_build
from grounding.spec import StructureSpec
from structdiffusion.observation import Arrangement, Scene

_STANDS = "what was built before stays as it stands"
_NO_OTHER = (
    "no visibly different arrangement was found, so the best one is proposed again; a less specific instruction leaves "
    "room for others"
)


class ProposalSession(TableSession):
    """A `TableSession` with proposed arrangements.

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
                self.take_up(replace(self.situation.dialogue, wish=situation.goal))  # what is said next may mend it
            if isinstance(error, NoValidGoal):
                self._unmet = (self.situation, situation)
            self._look_at_pending()
            raise

    def take_up(self, dialogue: Dialogue) -> None:
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
        self._turn.step = "scene"
        if self.table.tidy_up():
            self.send(events.Noted("the arm emptied its hand and folded"))
            situation = replace(situation, poses=self.table.poses())
        if not other:
            self._shown = []
        self._offer(self._planned(situation, self.send))

    def _offer(self, situation: Situation) -> None:
        """Let a situation with a proposal be the present one, and tell which arrangement of it is chosen."""
        self._remember(situation)
        proposal = self._proposed()
        self.show_ranks([proposal.rank])
        self.send(proposal.chosen)
        if aside := describe_aside(proposal.chosen):
            self.send(events.Noted(aside))
        arrangement = proposal.proposed.arrangements[proposal.rank - 1]
        if sizes := describe_sizes(proposal.scene, proposal.wanted, arrangement):
            self.send(events.Noted(sizes))

    def _wanting(self, dialogue: Dialogue) -> Situation:
        """Return the present situation with another state of what was said, and nothing proposed yet."""
        return replace(
            self.situation, dialogue=dialogue, names=self.table.original_names, poses=self.table.poses(), proposal=None,
            viewpoint=self.options.reading.viewpoint, missing={},
        )  # fmt: skip

    def _planned(
        self, situation: Situation, tell: Callable[[Event], None], left: Remainder | None = None, before: Goal = Goal()
    ) -> Situation:
        """Look at the table and propose arrangements of a situation's wish; return the situation with the proposal.

        Args:
            situation: what is wanted.
            tell: called with the events.
            left: what is left of a build that ends for it.
            before: the goal of that build.
        """
        began = time.perf_counter()
        whole, missing = with_what_is_there(self.table, situation.goal)
        goal = still_to_build(whole, situation.dialogue.standing)
        if not goal.parts and left is None:
            raise NotBuildable("it is already built; “put it back” undoes the last build")
        if situation.dialogue.standing:
            tell(events.Noted(_STANDS))
        situation = replace(situation, missing=missing)
        wanted, everything = self._on_table(goal if goal.parts else whole)
        scene = everything.select(wanted.movable) if isinstance(wanted, TableGoal) else everything
        self.table.missing = missing
        if shortfall := describe_shortfall(self.table, "take part"):
            tell(events.Noted(shortfall))
        looking = time.perf_counter() - began
        tell(perceived_event(scene, looking, self.table))
        if fixed := describe_fixed(scene):
            tell(events.Noted(fixed))
        self._turn.step = "propose"
        options, cache = self.options, self._cache
        cache.check_planner(options.model, options.weights, options.allow_unverified)
        networks = cache.provenance(options.model, options.weights)
        for one in networks.values():
            if not one.verified:
                tell(events.Noted(one.card))
        proposed = None
        if left is not None:
            same = situation.goal.canonical() == before.canonical()
            proposed = self._laid_around(carried_over(left, scene), wanted, before, same, bool(goal.parts))
        proposed = replace(proposed or self._arranged(everything, wanted, tell), networks=networks)
        if len(proposed.scene.objects) > self.table.count:  # something has to be set aside, and takes part too
            self.table.involve([cloud.name for cloud in proposed.scene.objects])
            tell(perceived_event(proposed.scene, looking, self.table))
        tell(proposed)
        spec = wanted if isinstance(wanted, StructureSpec) else None
        viable = len(filter_viable(proposed.arrangements, proposed.scene, spec))
        self.ranks = other_ranks(proposed.arrangements, proposed.scene, self._shown)
        if not self.ranks:
            tell(events.Noted(_NO_OTHER))
            self.ranks = list(range(1, viable + 1))
        proposal = Proposal(situation.goal, wanted, proposed.scene, proposed, viable, self.ranks[0])
        return replace(situation, proposal=proposal, shown=proposal)

    def _on_table(self, goal: Goal) -> tuple[StructureSpec | TableGoal, Scene]:
        """Look at the table for a goal; return what is planned of it, and the scene, of several parts with everything
        as its objects.
        """
        spec = goal.plain_spec
        if spec is None or not planned_as_structure(spec):
            wanted, everything = put_on_table(self.table, goal)
            return wanted, with_fixed(everything, self.table.arm.hand, self.table.arm.hold)
        taking = [self.table.original_names[index] for index in goal.named_objects()]  # type: ignore[index]
        if len(taking) > MOST_OBJECTS:
            raise NotBuildable(f"{len(taking)} objects would take part; legal: up to {MOST_OBJECTS}")
        self.table.involve(taking)
        return spec, with_fixed(self.table.look(), self.table.arm.hand, self.table.arm.hold)

    def _arranged(
        self,
        scene: Scene,
        wanted: StructureSpec | TableGoal,
        on_preview: Callable[[events.Previewed], None] | None = None,
    ) -> events.Proposed:
        """Propose arrangements of one structure of all objects of a scene, or of a goal over them.

        Raises:
            NotBuildable, NoValidGoal: if there are none.
        """
        options, cache = self.options, self._cache
        chosen = (options.model, options.weights, options.allow_unverified)
        if isinstance(wanted, TableGoal):
            return propose_goal(cache.goal_planner(*chosen), options.model, scene, wanted, options.seed)
        asked = make_goal(wanted, cache.encoder)
        return propose_arrangements(cache.planner(*chosen), options.model, scene, asked, options.seed, on_preview)

    def _laid_around(
        self, left: Remainder, wanted: StructureSpec | TableGoal, before: Goal, same: bool, to_build: bool
    ) -> events.Proposed | None:
        """Lay a goal out around what stands of another build, or of the same; `None` if there is no such arrangement.

        Args:
            left: what is left of that build, for the objects of this one.
            wanted: the goal.
            before: the goal of that build.
            same: whether that is the same one.
            to_build: whether anything of this one does not stand yet.
        """
        began, count = time.perf_counter(), len(left.left)
        scene = replace(left.first, objects=left.first.objects[:count], distractors=left.others)
        found = list[Arrangement]()
        if same or not to_build:
            as_it_was = left.goal_from_initial[:count].copy()
            as_it_was[list(left.standing) if to_build else slice(None)] = np.eye(4)
            found.append(Arrangement(as_it_was, {"total": 1.0}))
        if to_build:
            lines = described_parts(before, self.table.original_names)
            found += laid_around(wanted, left, lines, self._arranged)
        return proposed_event(self.options.model, scene, found, time.perf_counter() - began) if found else None

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
            raise UsageError("you have not asked for anything yet; say what to build")
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
            raise UsageError("you have not asked for anything yet; say what to build")
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

    def _go_to(self, how: str, situation: Situation | None, keep_question: bool = False) -> None:
        super()._go_to(how, situation, keep_question)
        self._look_at_pending()
        self._asked_again()

    def _look_at_pending(self) -> None:
        """Let the table and all listeners turn to the objects of the pending proposal, which can be built now."""
        if (pending := self.situation.proposal) is not None:
            self.table.involve([cloud.name for cloud in pending.scene.objects])
            self.table.missing = self.situation.missing
            self.send(perceived_event(pending.scene, 0.0, self.table))
