"""Where a conversation stands: the wish, who takes part, what stands where, and what is proposed."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from agent import events, steps
from agent.errors import NotBuildable
from agent.scenes.taking_part import FEWEST_OBJECTS, MOST_OBJECTS
from grounding.dialogue import Revision
from grounding.names import read_name
from grounding.object_changes import EVERYTHING
from grounding.parse import OPEN, WHICH_SHAPE
from grounding.replacements import IMPOSSIBLE
from grounding.selection import AmbiguousReferenceError, Selection, SelectionError, select_objects
from grounding.spec import SLOTS, SLOTS_OF_SHAPE, StructureSpec
from grounding.unsupported import CORNER, CORNERS

if TYPE_CHECKING:
    from agent.scenes.table import TableScene
    from grounding.encoder import SentenceEncoder
    from structdiffusion.observation import Arrangement, Scene

# "Object 3", "the second cup": counted among all that are there.
_COUNTED_OFF = re.compile(r"\d|\b(?:first|second|third|fourth|fifth|last)\b")


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

    @cached_property
    def realised(self) -> StructureSpec:
        """The size, place and heading that the chosen arrangement has, asked for or not, in the world's frame."""
        from structdiffusion.estimate import estimate, imagined_bodies
        from structdiffusion.slots import realised_spec

        seen = [estimate(cloud) for cloud in self.scene.objects]
        bodies = imagined_bodies(seen, self.imagined.arrangements[self.rank - 1].goal_from_initial)
        return realised_spec(bodies, self.scene.table, self.spec.shape)


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
        shown: the last proposal, also where it was declined or is built.
        missing: name -> why an object that was asked for takes no part.
        builds: what was built up to here and not put back, the last one last.
    """

    wish: StructureSpec | None
    objects: tuple[str, ...]
    poses: Mapping[str, np.ndarray]
    proposal: Proposal | None = None
    viewpoint: str = "robot"
    shown: Proposal | None = None
    missing: Mapping[str, str] = field(default_factory=dict)
    builds: tuple[Build, ...] = ()

    @property
    def stands(self) -> StructureSpec | None:
        """What the last proposal realises, as it would be spoken; `None` before there was one."""
        realised = self.shown and self.shown.realised
        return realised.turned() if realised and self.viewpoint == "opposite" else realised

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


class UnclearObjectError(NotBuildable):
    """Several objects on the table fit words that speak of one.

    Attributes:
        phrase: the words.
        names: of the objects that may be meant.
    """

    def __init__(self, message: str, phrase: str, names: tuple[str, ...]) -> None:
        self.phrase, self.names = phrase, names
        super().__init__(message)


@dataclass(frozen=True)
class Taking:
    """Who takes part.

    Attributes:
        names: of the objects that do.
        missing: name -> why an object that was asked for does not.
        notes: what has to be said about the choice, a sentence each.
    """

    names: tuple[str, ...]
    missing: Mapping[str, str]
    notes: tuple[str, ...]


def meant_objects(
    revision: Revision,
    table: TableScene,
    situation: Situation,
    encoder: SentenceEncoder,
    resolved: Mapping[str, str] = MappingProxyType({}),
) -> Taking:
    """Find the objects that take part after what was said.

    Args:
        revision: what was said.
        table: what stands there now.
        situation: where the conversation stood.
        encoder: finds what unknown nouns mean.
        resolved: phrase -> name of the object that an answer said it means.

    Raises:
        UnclearObjectError: when several objects fit words that speak of one.
        SelectionError: when something is named that is not there.
        NotBuildable: when too few or too many take part, when what should go takes no part, when what should come
            does already, and when a change speaks of some of those that take part.
    """
    gone = {*table.fallen, *table.out_of_reach}
    there = tuple(name for name in table.names if name not in gone)
    before = tuple(name for name in (table.names if situation.wish is None else situation.objects) if name not in gone)
    choose = _Choice(table, there, before, encoder, resolved)
    if revision.objects_about:
        choose.all_of(revision.objects_about)
    text = revision.objects_text or ""
    match revision.objects_how:
        case "add":
            meant = (*before, *choose.coming(text))
        case "remove":
            goes = choose.going(text)
            meant = tuple(name for name in before if name not in goes)
        case "exchange" | "swap":
            goes, comes = choose.going(revision.objects_out_text), choose.coming(text, goes=True)
            if revision.objects_how == "swap" and set(comes) <= set(before):
                raise NotBuildable(IMPOSSIBLE["places"].format(f"swap {', '.join(goes)} with {', '.join(comes)}"))
            meant = (*(name for name in before if name not in goes or name in comes), *comes)
        case "others":
            meant = tuple(name for name in there if name not in before)
            if not meant:
                raise NotBuildable("there are no others: everything on the table takes part already")
        case "replace":
            meant = choose.of(text, there, all_there=True)
            if text == EVERYTHING and situation.wish is not None and not revision.changed and set(meant) == set(before):
                raise NotBuildable("everything on the table takes part already")
        case _:
            meant = before
    meant = tuple(dict.fromkeys(meant))
    if not FEWEST_OBJECTS <= len(meant) <= MOST_OBJECTS:
        which = f" ({', '.join(meant)})" if meant else ""
        objects = "1 object" if len(meant) == 1 else f"{len(meant)} objects"
        legal = f"legal: {FEWEST_OBJECTS} to {MOST_OBJECTS}"
        if revision.kind == "edit" and revision.objects_how == "replace" and len(meant) == 1:
            legal += f"; say 'add {text}', or 'replace ... with {text}', to keep the others"
        reasons = "".join(f"; {name}: {why}" for name, why in choose.missing.items())
        raise NotBuildable(f"{objects} would take part{which}; {legal}{reasons}")
    missing = choose.missing if revision.objects_text is not None else situation.missing
    return Taking(meant, dict(missing), tuple(dict.fromkeys(choose.notes)))


@dataclass(frozen=True)
class _Choice:
    """Finds objects by their description, among those on the table and among those that take part."""

    table: TableScene
    there: tuple[str, ...]
    before: tuple[str, ...]
    encoder: SentenceEncoder
    resolved: Mapping[str, str]
    missing: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def of(self, text: str, names: Sequence[str], all_there: bool = False) -> tuple[str, ...]:
        """Those of these objects that the text describes.

        Args:
            text: the description.
            names: the objects.
            all_there: they are all that can take part: what else fits is missing.

        Raises:
            UnclearObjectError: when several of them fit words that speak of one.
            SelectionError: when something is named that is not among them.
        """
        if all_there:
            self._find_missing(text, names)
        selection = self._selection(text, names)
        self.notes.extend(selection.notes)
        return tuple(names[i] for i in selection.indices)

    def _selection(self, text: str, names: Sequence[str]) -> Selection:
        referents = dict(zip(self.table.names, self.table.referents, strict=True))
        resolved = {phrase: names.index(name) for phrase, name in self.resolved.items() if name in names}
        try:
            return select_objects(text, [referents[name] for name in names], self.encoder, resolved=resolved)
        except AmbiguousReferenceError as error:
            raise UnclearObjectError(str(error), error.phrase, tuple(names[i] for i in error.indices)) from error

    def _find_missing(self, text: str, names: Sequence[str]) -> None:
        """Notes what the text describes that cannot take part.

        Raises:
            NotBuildable: when such an object was named by itself.
        """
        gone = {name: "it has fallen off the table" for name in self.table.fallen}
        gone |= {name: "the arm cannot take it" for name in self.table.out_of_reach}
        everything = (*names, *gone)
        try:
            selection = self._selection(text, everything) if gone else None
        except (SelectionError, UnclearObjectError):  # told of what can take part
            return
        if selection is None:
            return
        if required := [everything[i] for i in selection.required if everything[i] in gone]:
            raise NotBuildable("; ".join(f"{name} cannot take part: {gone[name]}" for name in required))
        self.missing.update((everything[i], gone[everything[i]]) for i in selection.indices if everything[i] in gone)

    def going(self, text: str) -> tuple[str, ...]:
        """What is described and takes part: "the cup" is one that does, where there are several.

        Raises:
            NotBuildable: when no such object takes part.
        """
        described = self._rather(text, self.before)
        goes = tuple(name for name in described if name in self.before)
        if not goes:
            verb = "takes" if len(described) == 1 else "take"
            raise NotBuildable(f"{', '.join(described)} {verb} no part; taking part: {', '.join(self.before)}")
        return goes

    def coming(self, text: str, goes: bool = False) -> tuple[str, ...]:
        """What is described, rather those that take no part yet.

        Args:
            text: the description.
            goes: whether others go, so that there is something to change even where these take part.

        Raises:
            NotBuildable: when nothing would change, because they take part already.
        """
        described = self._rather(text, tuple(name for name in self.there if name not in self.before), some=True)
        if not goes and set(described) <= set(self.before):
            raise NotBuildable(f"{', '.join(described)} take{'s' * (len(described) == 1)} part already")
        return described

    def all_of(self, text: str) -> None:
        """Looks whether the text describes all that take part.

        Raises:
            NotBuildable: when it describes some of them: only the whole structure can be changed.
        """
        described = self._rather(text, self.before)
        if others := [name for name in self.before if name not in described]:
            raise NotBuildable(
                f"{', '.join(described)} cannot be placed alone, only the whole structure can; "
                f"{', '.join(others)} take{'s' * (len(others) == 1)} part too"
            )

    def _rather(self, text: str, names: tuple[str, ...], some: bool = False) -> tuple[str, ...]:
        """What is described, of these objects where it may be either them or others of the same kind.

        Args:
            text: the description.
            names: those that are rather meant.
            some: whether it does where some of what is described is among them.
        """
        try:
            described = self.of(text, self.there)
        except UnclearObjectError:  # "the cup" is one that is rather meant, where that is one
            return self.of(text, names)
        among = [name for name in described if name in names]
        if not names or (among if some else len(among) == len(described)) or _COUNTED_OFF.search(text):
            return described
        try:
            others = self.of(text, names)
        except SelectionError:
            return described
        kinds = {read_name(name).head for name in described}
        return others if all(read_name(name).head in kinds for name in others) else described


def answered(spec: StructureSpec, slot: str, value: str | None) -> StructureSpec:
    """The wish with an answer in it; what a shape that was answered cannot carry is left out."""
    value = None if value == OPEN else value
    if slot == CORNER:
        x_position, y_position = CORNERS[value] if value else (None, None)
        return replace(spec, x_position=x_position, y_position=y_position)
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
