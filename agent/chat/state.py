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
    """Ranked arrangements for a goal, and the one that would be built.

    Attributes:
        spec: the goal in the world's frame.
        scene: what was seen.
        imagined: every arrangement.
        viable_count: how many of them, the best first, are worth a try.
        rank: of the chosen one, from 1.
        several: a goal of several parts, in the world's frame; `None` for one structure, which `spec` says.
    """

    spec: StructureSpec
    scene: Scene
    imagined: events.Imagined
    viable_count: int
    rank: int = 1
    several: TableGoal | None = None

    @property
    def chosen(self) -> events.Chosen:
        """The event of the choice."""
        return chosen_event(self.rank, self.imagined.arrangements[self.rank - 1], self.scene, self.several)

    @property
    def wanted(self) -> StructureSpec | TableGoal:
        """What is asked for."""
        return self.spec if self.several is None else self.several

    @property
    def ranks_to_try(self) -> list[int]:
        """What to try, in this order: the chosen arrangement, then the others that are worth it."""
        return [self.rank, *(rank for rank in range(1, self.viable_count + 1) if rank != self.rank)]

    @property
    def arrangements_to_try(self) -> list[Arrangement]:
        """The arrangements of these ranks."""
        return [self.imagined.arrangements[rank - 1] for rank in self.ranks_to_try]

    @cached_property
    def realised(self) -> StructureSpec:
        """The size, place and heading that the chosen arrangement has, asked for or not, in the world's frame; nothing
        for a goal of several parts.
        """
        if self.several is not None:
            return StructureSpec()
        from structdiffusion.completion.estimate import estimate, imagined_bodies
        from structdiffusion.protocol.slot_measurement import realised_spec

        seen = [estimate(cloud) for cloud in self.scene.objects]
        bodies = imagined_bodies(seen, self.imagined.arrangements[self.rank - 1].goal_from_initial)
        return realised_spec(bodies, self.scene.table, self.spec.shape)


@dataclass(frozen=True)
class Build:
    """One build, or attempt at one.

    Attributes:
        goal: what was to be built, as it was spoken.
        objects: the names of those that took part.
        before: name -> world_from_object (4, 4) of everything on the table before.
        moved: the names of the objects that stand elsewhere since.
        trouble: why it does not stand as asked; empty where it does.
        parts, names: as of the situation.
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
        goal: what is wanted, as it was spoken; `None` before the first instruction.
        objects: the names of those that take part.
        poses: name -> world_from_object (4, 4) of everything on the table.
        proposal: what would be built; `None` where there is nothing to decide.
        viewpoint: whose left and right the goal speaks of.
        shown: the last proposal, also where it was declined or is built.
        missing: name -> why an object that was asked for takes no part.
        builds: what was built up to here and not put back, the last one last.
        parts: a goal of several parts in the world's frame, its objects as indices into the table's `original_names`;
            `None` where what is wanted is the one structure of `goal`.
        names: the table's `original_names`, where there are parts.
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
        """Whether anything was asked for."""
        return self.goal is not None or self.parts is not None

    @property
    def built(self) -> bool:
        """Whether what was asked for last stands, built by the arm."""
        last = self.builds[-1] if self.builds else None
        if last is None or last.trouble or not last.moved:
            return False
        return (last.goal, last.objects, last.parts) == (self.goal or StructureSpec(), self.objects, self.parts)

    @property
    def spoken_parts(self) -> Goal | None:
        """A goal of several parts as it was spoken."""
        return self.parts.turned() if self.parts is not None and self.viewpoint == "opposite" else self.parts

    @property
    def stands(self) -> StructureSpec | None:
        """What the last proposal realises, as it would be spoken; `None` before there was one."""
        realised = self.shown and self.shown.realised
        return realised.turned() if realised and self.viewpoint == "opposite" else realised

    @property
    def spec(self) -> StructureSpec | None:
        """The goal in the world's frame."""
        return self.goal.turned() if self.goal and self.viewpoint == "opposite" else self.goal

    def seen_from(self, viewpoint: str) -> Situation:
        """Return the same situation, its goal in the words of a speaker at this side of the table."""
        if viewpoint == self.viewpoint:
            return self
        builds = tuple(replace(build, goal=build.goal.turned()) for build in self.builds)
        return replace(self, goal=self.goal and self.goal.turned(), viewpoint=viewpoint, builds=builds)


def apply_answer(spec: StructureSpec, slot: str, value: str | None) -> StructureSpec:
    """Return the goal with an answer in it; slots that the answered shape does not have are left out."""
    value = None if value == OPEN else value
    if slot == CORNER:
        x_position, y_position = CORNERS[value] if value else (None, None)
        return replace(spec, x_position=x_position, y_position=y_position)
    if slot != "shape":
        return replace(spec, **{slot: value})
    kept = {name: getattr(spec, name) for name in SLOTS_OF_SHAPE[value]}
    return StructureSpec(value, **kept)


def complete_spec(said: StructureSpec, before: StructureSpec) -> StructureSpec:
    """Return what was said, completed from before where it leaves open slots of its shape."""
    legal = ("shape", *SLOTS_OF_SHAPE[said.shape or before.shape])
    values = {slot: getattr(said, slot) or getattr(before, slot) for slot in SLOTS}
    return StructureSpec(**{slot: value for slot, value in values.items() if slot in legal})


def with_a_shape(revision: Revision, last: StructureSpec) -> Revision:
    """Return the revision, with a question where it was not said yet what is to be built, or anything at all.

    Args:
        revision: what was said.
        last: the goal before; nothing specified where there was none.
    """
    first_words = revision.kind == "edit" and last == StructureSpec()
    if revision.status != "ok" or revision.spec.shape is not None:
        return revision
    if not first_words and revision.spec != StructureSpec():
        return revision
    return replace(revision, status="ask", question=WHICH_SHAPE)
