"""Where a conversation stands: the wish, who takes part, what stands where, and what is proposed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from agent import events, steps
from agent.errors import NotBuildable
from agent.scenes.taking_part import FEWEST_OBJECTS, MOST_OBJECTS
from grounding.dialogue import Revision
from grounding.parse import OPEN, WHICH_SHAPE
from grounding.selection import select_objects
from grounding.spec import SLOTS, SLOTS_OF_SHAPE, StructureSpec

if TYPE_CHECKING:
    from agent.scenes.table import TableScene
    from grounding.encoder import SentenceEncoder
    from structdiffusion.observation import Arrangement, Scene


@dataclass(frozen=True)
class Proposal:
    """Ranked arrangements for a wish, and the one that would be built.

    Attributes:
        spec: the wish in the world's frame.
        scene: what was seen.
        imagined: every arrangement.
        worth: how many of them, the best first, are worth a try.
        rank: of the chosen one, from 1.
    """

    spec: StructureSpec
    scene: Scene
    imagined: events.Imagined
    worth: int
    rank: int = 1

    @property
    def chosen(self) -> events.Chosen:
        """The choice, as it is told."""
        return steps.chosen(self.rank, self.imagined.arrangements[self.rank - 1], self.scene)

    @property
    def ranks(self) -> list[int]:
        """What to try, in this order: the chosen arrangement, then the others that are worth it."""
        return [self.rank, *(rank for rank in range(1, self.worth + 1) if rank != self.rank)]

    @property
    def choice(self) -> list[Arrangement]:
        """The arrangements of these ranks."""
        return [self.imagined.arrangements[rank - 1] for rank in self.ranks]


@dataclass(frozen=True)
class Build:
    """One time that the arm was set to work.

    Attributes:
        wish: what was to be built, as it was spoken.
        objects: the names of those that took part.
        before: name -> world_from_object (4, 4) of everything on the table before.
        moved: the names of the objects that stand elsewhere since.
        trouble: why it does not stand as asked; empty where it does.
    """

    wish: StructureSpec
    objects: tuple[str, ...]
    before: Mapping[str, np.ndarray]
    moved: tuple[str, ...]
    trouble: str


@dataclass(frozen=True)
class Situation:
    """Where a conversation stands, which is what "undo" goes back to.

    Attributes:
        wish: what is wanted, as it was spoken; `None` before the first instruction.
        objects: the names of those that take part.
        poses: name -> world_from_object (4, 4) of everything on the table.
        proposal: what would be built; `None` where there is nothing to decide.
        viewpoint: whose left and right the wish speaks of.
        builds: what was built up to here and not put back, the last one last.
    """

    wish: StructureSpec | None
    objects: tuple[str, ...]
    poses: Mapping[str, np.ndarray]
    proposal: Proposal | None = None
    viewpoint: str = "robot"
    builds: tuple[Build, ...] = ()

    @property
    def spec(self) -> StructureSpec | None:
        """The wish in the world's frame."""
        return self.wish.turned() if self.wish and self.viewpoint == "opposite" else self.wish

    def seen_from(self, viewpoint: str) -> Situation:
        """The same situation, its wish in the words of somebody at this side of the table."""
        if viewpoint == self.viewpoint:
            return self
        builds = tuple(replace(build, wish=build.wish.turned()) for build in self.builds)
        return replace(self, wish=self.wish and self.wish.turned(), viewpoint=viewpoint, builds=builds)


def meant_objects(
    revision: Revision, table: TableScene, before: Situation, encoder: SentenceEncoder
) -> tuple[str, ...]:
    """The names of the objects that take part after what was said.

    Args:
        revision: what was said.
        table: what stands there now.
        before: where the conversation stood.
        encoder: finds what unknown nouns mean.

    Raises:
        SelectionError: when something is named that is not there.
        NotBuildable: when too few or too many take part.
    """
    gone = {*table.fallen, *table.out_of_reach}
    there = [i for i, name in enumerate(table.names) if name not in gone]
    named = table.names if before.wish is None else before.objects
    if revision.objects_text is not None:
        indices = select_objects(revision.objects_text, [table.called[i] for i in there], encoder).indices
        chosen = tuple(table.names[there[i]] for i in indices)
        match revision.objects_how:
            case "add":
                named = tuple(dict.fromkeys((*before.objects, *chosen)))
            case "remove":
                named = tuple(name for name in before.objects if name not in chosen)
            case _:
                named = chosen
    meant = tuple(name for name in named if name not in gone)
    if not FEWEST_OBJECTS <= len(meant) <= MOST_OBJECTS:
        which = f" ({', '.join(meant)})" if meant else ""
        objects = "1 object" if len(meant) == 1 else f"{len(meant)} objects"
        raise NotBuildable(f"{objects} would take part{which}; legal: {FEWEST_OBJECTS} to {MOST_OBJECTS}")
    return meant


def answered(spec: StructureSpec, slot: str, value: str | None) -> StructureSpec:
    """The wish with an answer in it; what a shape that was answered cannot carry is left out."""
    value = None if value == OPEN else value
    if slot != "shape":
        return replace(spec, **{slot: value})
    kept = {name: getattr(spec, name) for name in SLOTS_OF_SHAPE[value]}
    return StructureSpec(value, **kept)


def completed(said: StructureSpec, before: StructureSpec) -> StructureSpec:
    """What was said, and from before what it leaves open and can carry."""
    legal = ("shape", *SLOTS_OF_SHAPE[said.shape or before.shape])
    values = {slot: getattr(said, slot) or getattr(before, slot) for slot in SLOTS}
    return StructureSpec(**{slot: value for slot, value in values.items() if slot in legal})


def with_a_shape(revision: Revision, last: StructureSpec) -> Revision:
    """The revision, with a question where nobody has said yet what is to be built, or anything at all.

    Args:
        revision: what was said.
        last: the wish before; nothing specified where there was none.
    """
    first_words = revision.kind == "edit" and last == StructureSpec()
    if revision.status != "ok" or revision.spec.shape is not None:
        return revision
    if not first_words and revision.spec != StructureSpec():
        return revision
    return replace(revision, status="ask", question=WHICH_SHAPE)
