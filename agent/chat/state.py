"""Hold the state of a conversation: the goal, the objects that take part, all poses, and the proposal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from agent import events
from agent.pipeline.event_builders import chosen_event
from agent.pipeline.table_goal import TableGoal
from grounding.dialogue.revise import Revision
from grounding.goals.goal import Goal
from grounding.parse_result import OPEN, WHICH_SHAPE
from grounding.spec import SLOTS, SLOTS_OF_SHAPE, StructureSpec
from grounding.unsupported import CORNER, CORNERS

if TYPE_CHECKING:
    from structdiffusion.observation import Arrangement, Scene


@dataclass(frozen=True)
class Proposal:
    """The ranked arrangements for a goal and the chosen one.

    Attributes:
        spec: the goal in the world's frame.
        scene: the observation.
        proposed: the event with all arrangements.
        viable_count: the number of arrangements, best first, that are worth trying.
        rank: the rank of the chosen arrangement, from 1.
        several: a goal of several parts in the world's frame; `None` for a single structure, which is in `spec`.
    """

    spec: StructureSpec
    scene: Scene
    proposed: events.Proposed
    viable_count: int
    rank: int = 1
    several: TableGoal | None = None

    @property
    def chosen(self) -> events.Chosen:
        """Return the event of the choice."""
        return chosen_event(self.rank, self.proposed.arrangements[self.rank - 1], self.scene, self.several)

    @property
    def wanted(self) -> StructureSpec | TableGoal:
        """Return the goal."""
        return self.spec if self.several is None else self.several

    @property
    def ranks_to_try(self) -> list[int]:
        """Return the ranks to try in order: the chosen arrangement, then the other viable ones."""
        return [self.rank, *(rank for rank in range(1, self.viable_count + 1) if rank != self.rank)]

    @property
    def arrangements_to_try(self) -> list[Arrangement]:
        """Return the arrangements of `ranks_to_try`."""
        return [self.proposed.arrangements[rank - 1] for rank in self.ranks_to_try]

    @cached_property
    def realised(self) -> StructureSpec:
        """Return the size, place and heading of the chosen arrangement in the world's frame, requested or not; all
        unspecified for a goal of several parts.
        """
        if self.several is not None:
            return StructureSpec()
        from structdiffusion.completion.estimate import estimate, imagined_bodies
        from structdiffusion.protocol.slot_measurement import realised_spec

        seen = [estimate(cloud) for cloud in self.scene.objects]
        bodies = imagined_bodies(seen, self.proposed.arrangements[self.rank - 1].goal_from_initial)
        return realised_spec(bodies, self.scene.table, self.spec.shape)


@dataclass(frozen=True)
class Build:
    """A build or an attempt at one.

    Attributes:
        goal: the slots from the speaker's viewpoint.
        objects: the names of the participants.
        before: name -> world_from_object (4, 4) of every object before the build.
        moved: the names of the objects that it moved.
        trouble: why it does not stand as asked; empty if it does.
        parts, names: as in `Situation`.
    """

    goal: StructureSpec
    objects: tuple[str, ...]
    before: Mapping[str, np.ndarray]
    moved: tuple[str, ...]
    trouble: str
    parts: Goal | None = None
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class Situation:
    """The state of a conversation, to which "undo" can return.

    Attributes:
        goal: the slots from the speaker's viewpoint; `None` before the first instruction.
        objects: the names of the participants.
        poses: name -> world_from_object (4, 4) of every object on the table.
        proposal: the pending proposal, if any.
        viewpoint: whose left and right the goal means.
        shown: the last proposal, including one that was declined or built.
        missing: name -> why an object that was asked for takes no part.
        builds: the builds so far that were not put back, oldest first.
        parts: a goal of several parts in the world's frame, with objects as indices into the table's `original_names`;
            `None` if the goal is the single structure of `goal`.
        names: the table's `original_names` if there are parts.
    """

    goal: StructureSpec | None
    objects: tuple[str, ...]
    poses: Mapping[str, np.ndarray]
    proposal: Proposal | None = None
    viewpoint: str = "robot"
    shown: Proposal | None = None
    missing: Mapping[str, str] = field(default_factory=dict)
    builds: tuple[Build, ...] = ()
    parts: Goal | None = None
    names: tuple[str, ...] = ()

    @property
    def asked(self) -> bool:
        """Return whether anything was asked for."""
        return self.goal is not None or self.parts is not None

    @property
    def built(self) -> bool:
        """Return whether the arm has built the last request successfully."""
        last = self.builds[-1] if self.builds else None
        if last is None or last.trouble or not last.moved:
            return False
        return (last.goal, last.objects, last.parts) == (self.goal or StructureSpec(), self.objects, self.parts)

    @property
    def declined(self) -> bool:
        """Return whether the last proposal is neither pending nor built."""
        return self.proposal is None and self.shown is not None and not self.built

    @property
    def spoken_parts(self) -> Goal | None:
        """Return the goal of several parts from the speaker's viewpoint."""
        return self.parts.turned() if self.parts is not None and self.viewpoint == "opposite" else self.parts

    @property
    def stands(self) -> StructureSpec | None:
        """Return the slots that the last proposal realises, from the speaker's viewpoint; `None` before the first one.
        """
        realised = self.shown and self.shown.realised
        return realised.turned() if realised and self.viewpoint == "opposite" else realised

    @property
    def spec(self) -> StructureSpec | None:
        """Return the goal in the world's frame."""
        return self.goal.turned() if self.goal and self.viewpoint == "opposite" else self.goal

    def seen_from(self, viewpoint: str) -> Situation:
        """Return the same situation with its goal expressed from a viewpoint."""
        if viewpoint == self.viewpoint:
            return self
        builds = tuple(replace(build, goal=build.goal.turned()) for build in self.builds)
        return replace(self, goal=self.goal and self.goal.turned(), viewpoint=viewpoint, builds=builds)


def apply_answer(spec: StructureSpec, slot: str, value: str | None) -> StructureSpec:
    """Return the goal with an answer applied, without slots that the shape of the answer does not have."""
    value = None if value == OPEN else value
    if slot == CORNER:
        x_position, y_position = CORNERS[value] if value else (None, None)
        return replace(spec, x_position=x_position, y_position=y_position)
    if slot != "shape":
        return replace(spec, **{slot: value})
    kept = {name: getattr(spec, name) for name in SLOTS_OF_SHAPE[value]}
    return StructureSpec(value, **kept)


def complete_spec(said: StructureSpec, before: StructureSpec) -> StructureSpec:
    """Return the new goal, with open slots of its shape filled from the previous one."""
    legal = ("shape", *SLOTS_OF_SHAPE[said.shape or before.shape])
    values = {slot: getattr(said, slot) or getattr(before, slot) for slot in SLOTS}
    return StructureSpec(**{slot: value for slot, value in values.items() if slot in legal})


def with_a_shape(revision: Revision, last: StructureSpec) -> Revision:
    """Return the revision, with a question for the shape if no shape is known yet.

    Args:
        revision: the revision.
        last: the previous goal; all unspecified if there was none.
    """
    first_words = revision.kind == "edit" and last == StructureSpec()
    if revision.status != "ok" or revision.spec.shape is not None:
        return revision
    if not first_words and revision.spec != StructureSpec():
        return revision
    return replace(revision, status="ask", question=WHICH_SHAPE)
