"""Decide which objects take part after a line, which may add, remove or exchange some."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING

from agent.chat.state import Situation
from agent.errors import NotBuildable
from agent.scenes.limits import FEWEST_OBJECTS, MOST_OBJECTS
from grounding.dialogue.object_changes import EVERYTHING
from grounding.dialogue.replacements import IMPOSSIBLE
from grounding.dialogue.revise import Revision
from grounding.references.object_names import read_name
from grounding.references.selection import AmbiguousReferenceError, Selection, SelectionError, select_objects

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene
    from grounding.parsers.sentence_encoder import SentenceEncoder

# "Object 3", "the second cup": counted among all that are there.
_COUNTED_OFF = re.compile(r"\d|\b(?:first|second|third|fourth|fifth|last)\b")


class UnclearObjectError(NotBuildable):
    """Raised if several objects on the table fit words for a single one.

    Attributes:
        phrase: the words.
        names: the names of the objects that may be meant.
    """

    def __init__(self, message: str, phrase: str, names: tuple[str, ...]) -> None:
        self.phrase, self.names = phrase, names
        super().__init__(message)


@dataclass(frozen=True)
class Participants:
    """The objects that take part in a goal.

    Attributes:
        names: their names.
        missing: name -> why an object that was asked for takes no part.
        notes: remarks on the choice for the user, a sentence each.
    """

    names: tuple[str, ...]
    missing: Mapping[str, str]
    notes: tuple[str, ...]


def select_participants(
    revision: Revision,
    table: TableScene,
    situation: Situation,
    encoder: SentenceEncoder,
    resolved: Mapping[str, str] = MappingProxyType({}),
) -> Participants:
    """Find the objects that take part after a revision.

    Args:
        revision: the revision.
        table: the present table.
        situation: the state of the conversation before it.
        encoder: sentence encoder for unknown nouns.
        resolved: phrase -> name of the object that an answer chose for it.

    Raises:
        UnclearObjectError: if several objects fit words for a single one.
        SelectionError: if a named object is not on the table.
        NotBuildable: if too few or too many objects take part, if an object to be removed takes no part, if an object
            to be added takes part already, and if a change names only some of the participants.
    """
    gone = {*table.fallen, *table.out_of_reach}
    there = tuple(name for name in table.names if name not in gone)
    before = tuple(name for name in (table.names if not situation.asked else situation.objects) if name not in gone)
    finder = _ObjectFinder(table, there, before, encoder, resolved)
    selected = tuple(dict.fromkeys(_select(revision, finder, situation.asked)))
    if not FEWEST_OBJECTS <= len(selected) <= MOST_OBJECTS:
        raise NotBuildable(_count_error(revision, selected, finder.missing))
    missing = finder.missing if revision.objects_text is not None else situation.missing
    return Participants(selected, dict(missing), tuple(dict.fromkeys(finder.notes)))


def _select(revision: Revision, finder: _ObjectFinder, has_goal: bool) -> tuple[str, ...]:
    """Return the names of the participants, possibly with repetitions; raises as `select_participants` does."""
    text, before = revision.objects_text or "", finder.before
    if revision.objects_about:
        finder.check_that_all_are_described(revision.objects_about)
    match revision.objects_how:
        case "add":
            return (*before, *finder.find_joining(text))
        case "remove":
            goes = finder.find_leaving(text)
            return tuple(name for name in before if name not in goes)
        case "exchange" | "swap":
            goes, comes = finder.find_leaving(revision.objects_out_text), finder.find_joining(text, goes=True)
            if revision.objects_how == "swap" and set(comes) <= set(before):
                raise NotBuildable(IMPOSSIBLE["places"].format(f"swap {', '.join(goes)} with {', '.join(comes)}"))
            return (*(name for name in before if name not in goes or name in comes), *comes)
        case "others":
            others = tuple(name for name in finder.there if name not in before)
            if not others:
                raise NotBuildable("there are no others: everything on the table takes part already")
            return others
        case "replace":
            described = finder.find(text, finder.there, all_there=True)
            if text == EVERYTHING and has_goal and not revision.changed and set(described) == set(before):
                raise NotBuildable("everything on the table takes part already")
            return described
        case _:
            return before


def _count_error(revision: Revision, selected: Sequence[str], missing: Mapping[str, str]) -> str:
    which = f" ({', '.join(selected)})" if selected else ""
    objects = "1 object" if len(selected) == 1 else f"{len(selected)} objects"
    legal = f"legal: {FEWEST_OBJECTS} to {MOST_OBJECTS}"
    if revision.kind == "edit" and revision.objects_how == "replace" and len(selected) == 1:
        text = revision.objects_text or ""
        legal += f"; say 'add {text}', or 'replace ... with {text}', to keep the others"
    reasons = "".join(f"; {name}: {why}" for name, why in missing.items())
    return f"{objects} would take part{which}; {legal}{reasons}"


@dataclass(frozen=True)
class _ObjectFinder:
    """A search for described objects among those on the table and among the participants."""

    table: TableScene
    there: tuple[str, ...]
    before: tuple[str, ...]
    encoder: SentenceEncoder
    resolved: Mapping[str, str]
    missing: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def find(self, text: str, names: Sequence[str], all_there: bool = False) -> tuple[str, ...]:
        """Return the named objects that the text describes.

        Args:
            text: the description.
            names: the names of the objects to search.
            all_there: whether these are all objects that can take part, so that any other match is missing.

        Raises:
            UnclearObjectError: if several of them fit words for a single one.
            SelectionError: if a described object is not among them.
        """
        if all_there:
            self._find_missing(text, names)
        selection = self._selection(text, names)
        self.notes.extend(selection.notes)
        return tuple(names[i] for i in selection.indices)

    def _selection(self, text: str, names: Sequence[str]) -> Selection:
        resolved = {phrase: names.index(name) for phrase, name in self.resolved.items() if name in names}
        try:
            return select_objects(text, self.table.referents_of(names), self.encoder, resolved=resolved)
        except AmbiguousReferenceError as error:
            raise UnclearObjectError(str(error), error.phrase, tuple(names[i] for i in error.indices)) from error

    def _find_missing(self, text: str, names: Sequence[str]) -> None:
        """Return the described objects that cannot take part.

        Raises:
            NotBuildable: if such an object was named individually.
        """
        gone = {name: "it has fallen off the table" for name in self.table.fallen}
        gone |= {name: "the arm cannot take it" for name in self.table.out_of_reach}
        everything = (*names, *gone)
        try:
            selection = self._selection(text, everything) if gone else None
        except (SelectionError, UnclearObjectError):  # this is reported for the objects that can take part
            return
        if selection is None:
            return
        if required := [everything[i] for i in selection.required if everything[i] in gone]:
            raise NotBuildable("; ".join(f"{name} cannot take part: {gone[name]}" for name in required))
        self.missing.update((everything[i], gone[everything[i]]) for i in selection.indices if everything[i] in gone)

    def find_leaving(self, text: str) -> tuple[str, ...]:
        """Return the described participants: of several cups, "the cup" is the one that takes part.

        Raises:
            NotBuildable: if no such object takes part.
        """
        described = self._find_preferring(text, self.before)
        goes = tuple(name for name in described if name in self.before)
        if not goes:
            verb = "takes" if len(described) == 1 else "take"
            raise NotBuildable(f"{', '.join(described)} {verb} no part; taking part: {', '.join(self.before)}")
        return goes

    def find_joining(self, text: str, goes: bool = False) -> tuple[str, ...]:
        """Return the described objects, with preference for those that do not take part yet.

        Args:
            text: the description.
            goes: whether other objects are removed, so that the line changes something even if these take part already.

        Raises:
            NotBuildable: if nothing would change because they take part already.
        """
        described = self._find_preferring(
            text, tuple(name for name in self.there if name not in self.before), some=True
        )
        if not goes and set(described) <= set(self.before):
            raise NotBuildable(f"{', '.join(described)} take{'s' * (len(described) == 1)} part already")
        return described

    def check_that_all_are_described(self, text: str) -> None:
        """Check that the text describes all participants.

        Raises:
            NotBuildable: if it describes only some of them, since only the whole structure can be changed.
        """
        described = self._find_preferring(text, self.before)
        if others := [name for name in self.before if name not in described]:
            raise NotBuildable(
                f"{', '.join(described)} cannot be placed alone, only the whole structure can; "
                f"{', '.join(others)} take{'s' * (len(others) == 1)} part too"
            )

    def _find_preferring(self, text: str, names: tuple[str, ...], some: bool = False) -> tuple[str, ...]:
        """Return the described objects, with preference for the named ones if others of their kind fit too.

        Args:
            text: the description.
            names: the names of the preferred objects.
            some: whether it is enough that some of the described objects are among them.
        """
        try:
            described = self.find(text, self.there)
        except UnclearObjectError:  # "the cup" is a preferred one, where there is one
            return self.find(text, names)
        among = [name for name in described if name in names]
        if not names or (among if some else len(among) == len(described)) or _COUNTED_OFF.search(text):
            return described
        try:
            others = self.find(text, names)
        except SelectionError:
            return described
        kinds = {read_name(name).head for name in described}
        return others if all(read_name(name).head in kinds for name in others) else described
