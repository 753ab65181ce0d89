"""Hold the state of a conversation about a table: what was said, all poses, the proposal, and what was built."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from agent import events
from agent.pipeline.event_builders import chosen_event
from agent.pipeline.table_goal import TableGoal
from grounding.dialogue.state import Dialogue
from grounding.edits.rules import Standing
from grounding.goals.goal import Goal
from grounding.goals.parts import Part, StructurePart
from grounding.spec import StructureSpec

if TYPE_CHECKING:
    from structdiffusion.observation import Arrangement, Scene


@dataclass(frozen=True)
class Proposal:
    """The ranked arrangements for a goal and the chosen one.

    Attributes:
        goal: what was asked for, in the world's frame, with indices into the table's `original_names`.
        wanted: what is planned of it: the slots of one structure, or parts over the observed objects.
        scene: the observation.
        proposed: the event with all arrangements.
        viable_count: the number of arrangements, best first, that are worth trying.
        rank: the rank of the chosen arrangement, from 1.
    """

    goal: Goal
    wanted: StructureSpec | TableGoal
    scene: Scene
    proposed: events.Proposed
    viable_count: int
    rank: int = 1

    @property
    def several(self) -> TableGoal | None:
        """Return the parts that are planned; `None` for the slots of one structure."""
        return self.wanted if isinstance(self.wanted, TableGoal) else None

    @property
    def chosen(self) -> events.Chosen:
        """Return the event of the choice."""
        return chosen_event(self.rank, self.proposed.arrangements[self.rank - 1], self.scene, self.several)

    @property
    def ranks_to_try(self) -> list[int]:
        """Return the ranks to try in order: the chosen arrangement, then the other viable ones."""
        return [self.rank, *(rank for rank in range(1, self.viable_count + 1) if rank != self.rank)]

    @property
    def arrangements_to_try(self) -> list[Arrangement]:
        """Return the arrangements of `ranks_to_try`."""
        return [self.proposed.arrangements[rank - 1] for rank in self.ranks_to_try]

    @cached_property
    def realised(self) -> tuple[Standing, ...]:
        """Return the size, place and heading of each part of the goal in the chosen arrangement, requested or not, in
        the world's frame; nothing where only some of the goal was planned.
        """
        from structdiffusion.completion.estimate import estimate, imagined_bodies
        from structdiffusion.protocol.slot_measurement import realised_spec

        seen = [estimate(cloud) for cloud in self.scene.objects]
        bodies = imagined_bodies(seen, self.proposed.arrangements[self.rank - 1].goal_from_initial)
        several = self.several
        if several is None:
            assert isinstance(self.wanted, StructureSpec)  # it is one or the other
            return (Standing(realised_spec(bodies, self.scene.table, self.wanted.shape)),)
        if len(several.goal.parts) != len(self.goal.parts):
            return ()
        place = {cloud.name: number for number, cloud in enumerate(self.scene.objects)}

        def slots(part: Part) -> StructureSpec:
            if not isinstance(part, StructurePart):
                return StructureSpec()
            own = [bodies[place[several.names[one]]] for one in part.objects or ()]  # type: ignore[index]
            return realised_spec(own, self.scene.table, part.shape)

        return tuple(Standing(slots(part)) for part in several.goal.parts)


@dataclass(frozen=True)
class Build:
    """A build or an attempt at one.

    Attributes:
        goal: what was wanted, in the world's frame.
        names: of the objects by the goal's indices.
        before: name -> world_from_object (4, 4) of every object before the build.
        moved: the names of the objects that it moved.
        trouble: why it does not stand as asked; empty if it does.
        stood: the parts that stood before it.
    """

    goal: Goal
    names: tuple[str, ...]
    before: Mapping[str, np.ndarray]
    moved: tuple[str, ...]
    trouble: str
    stood: tuple[Part, ...] = ()


@dataclass(frozen=True)
class Situation:
    """The state of a conversation, to which "undo" can return.

    Attributes:
        dialogue: what was said: the goal so far, in the world's frame, with its question and its history.
        names: the table's `original_names`, to which the goal's indices refer.
        poses: name -> world_from_object (4, 4) of every object on the table.
        proposal: the pending proposal, if any.
        viewpoint: whose left and right is spoken of.
        shown: the last proposal, including one that was declined or built.
        missing: name -> why an object that was asked for takes no part.
        builds: the builds so far that were not put back, oldest first.
    """

    dialogue: Dialogue
    names: tuple[str, ...]
    poses: Mapping[str, np.ndarray]
    proposal: Proposal | None = None
    viewpoint: str = "robot"
    shown: Proposal | None = None
    missing: Mapping[str, str] = field(default_factory=dict)
    builds: tuple[Build, ...] = ()

    @property
    def goal(self) -> Goal:
        """Return what was asked for, in the world's frame."""
        return self.dialogue.goal

    @property
    def spoken(self) -> Goal:
        """Return what was asked for, from the speaker's viewpoint."""
        return self.goal.turned() if self.viewpoint == "opposite" else self.goal

    @property
    def objects(self) -> tuple[str, ...]:
        """Return the names of the objects that the goal names; all of them before anything was asked for."""
        return objects_of(self.goal, self.names)

    @property
    def asked(self) -> bool:
        """Return whether anything was asked for."""
        return bool(self.goal.parts)

    @property
    def built(self) -> bool:
        """Return whether all that was asked for stands."""
        return self.asked and len(self.dialogue.standing) == len(self.goal.parts)

    @property
    def stands(self) -> tuple[Standing, ...]:
        """Return what the last proposal of this goal realises of each part, in the world's frame."""
        return self.shown.realised if self.shown is not None and self.shown.goal == self.goal else ()


def objects_of(goal: Goal, names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the objects that take part in a goal: all where a part takes what no other names."""
    if not goal.parts or any(part.objects is None for part in goal.structures):
        return names
    named = set(goal.named_objects())
    return tuple(name for index, name in enumerate(names) if index in named)
