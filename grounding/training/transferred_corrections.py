"""Carry labelled corrections over to other goals, where their words mean the same.

"Right side, please" may be said of any structure, "thanks" of any goal; and what is said about a tower changes nothing
in a line of other objects beside it. Few corrections are labelled, so each teaches more in several places.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.vocabulary import HEADS, NO_GOAL
from grounding.goal_network.writer import words_of
from grounding.references.object_names import read_name
from grounding.references.word_forms import plural
from grounding.spec import LEGAL_VALUES
from grounding.training.goal_corrections import GoalCorrection, corrected
from grounding.training.goal_lines import GoalLine, LabelError, LabelledGoal

_Option = TypeVar("_Option")

BESIDE = 0.3  # share of the draws in which another part is put beside the goal
_SHAPES = frozenset(head.removesuffix(" of") for head in HEADS) - {"place", "move", "swap", "keep", "structure"}
# What else a shape or its objects are called: a text with such a word speaks of one goal only.
_SHAPE_WORDS = _SHAPES | set(
    "row rows column columns ring ringed stack stacked stacks pile piles table setting heap group groups clump box "
    "frame curve bow plus x lines circles towers it's structure structures one ones".split()
)
_PLAIN_WORDS = frozenset("the a an all of every each both any my these those that".split())
_ANSWERS_ANYWHERE = ("nothing", "impossible")  # what is unclear of one goal may be clear of another


@dataclass(frozen=True)
class _Change:
    """What a correction changes in one structure.

    Attributes:
        correction: labelled.
        shape: of the structure before.
        cells: old and new cells by key, `None` where there is none.
    """

    correction: GoalCorrection
    shape: str
    cells: dict[str, tuple[str | None, str | None]]


class TransferredCorrections:
    """Corrections that are drawn from labelled ones, each said about another goal.

    Args:
        corrections: labelled.
        lines: labelled instructions, whose goals they are said about.
        rng: draws.
    """

    def __init__(
        self, corrections: Sequence[GoalCorrection], lines: Sequence[GoalLine], rng: np.random.Generator
    ) -> None:
        self.rng = rng
        self.lines = [line for line in lines if line.label.strip(" .") not in NO_GOAL]
        self.single = [line for line in self.lines if _structure(line.label) is not None]
        self.answers = [row for row in corrections if row.after.strip(" .") in _ANSWERS_ANYWHERE and _of_any_goal(row)]
        changes = [_change_of(row) for row in corrections if not _names_objects(row)]
        self.changes = [change for change in changes if change is not None]
        self.parted = [row for row in corrections if row.after.strip(" .") not in (*NO_GOAL, "computed")]

    def draw(self) -> LabelledGoal:
        """Draw a task."""
        while True:
            kind = self.rng.random()
            if kind < BESIDE:
                row = self._beside()
            elif kind < BESIDE + 0.1:
                row = self._answer()
            else:
                row = self._changed()
            if row is None:
                continue
            try:
                return corrected(row).task
            except LabelError:
                continue

    def _answer(self) -> GoalCorrection | None:
        """Say something that changes no goal about some goal."""
        row, line = _one(self.answers, self.rng), _one(self.lines, self.rng)
        if set(words_of(row.text)) & _nouns(line.scene):
            return None  # what is missing in one scene may be there in another
        return replace(row, scene=line.scene, before=line.label)

    def _changed(self) -> GoalCorrection | None:
        """Say what changes a structure about another one, if the change is possible there."""
        change, line = _one(self.changes, self.rng), _one(self.single, self.rng)
        cells = _structure(line.label)
        assert cells is not None
        shape, _, objects = f"{cells['head']}".partition(" of ")
        cells["shape"] = shape
        said = set(words_of(change.correction.text))
        if said & _nouns(line.scene) or (said & _SHAPE_WORDS and shape != change.shape):
            return None
        after = dict(cells)
        for key, (old, new) in change.cells.items():
            there = cells.get(key)
            # A text that changes a value may speak of it ("the other side"); one that sets it may not repeat it.
            if there == new or (old is not None and there != old):
                return None
            after[key] = new
        keys = [cell for key, cell in after.items() if cell and key not in ("head", "shape")]
        label = ", ".join([f"{after['shape']} of {objects}", *keys])
        return GoalCorrection(line.scene, line.label, change.correction.text, f"{label}.")

    def _beside(self) -> GoalCorrection | None:
        """Put a part beside a goal of which the text does not speak, and which stays."""
        row = _one(self.parted, self.rng)
        others = [line for line in self.single if line.scene == row.scene]
        if not others:
            return None
        other = _one(others, self.rng).label.strip(" .")
        labels = (row.before, row.after)
        if _objects(other) & (_objects(row.before) | _objects(row.after)) or "(all)" in f"{other}{row.before}{row.after}":
            return None
        said, own, its = set(words_of(row.text)), _kinds(row.before), _kinds(other)
        if own & its or not said & (own | _nouns(row.scene)) or said & its or said & {"everything", "all", "both"}:
            return None
        if _nouns(row.scene, _objects(other)) & said:
            return None
        before, after = (f"{label.strip(' .')}; {other}." for label in labels)
        return replace(row, before=before, after=after)


def _one(options: Sequence[_Option], rng: np.random.Generator) -> _Option:
    return options[rng.integers(len(options))]


def _structure(label: str) -> dict[str, str | None] | None:
    """Return the cells of a label by their keys; `None` unless it is one structure that says which objects it has."""
    parts = [part for part in _parts(label) if not part[0].startswith("keep of")]
    head = parts[0][0] if parts else ""
    if len(parts) != len(_parts(label)) or len(parts) != 1 or head.partition(" of ")[0] not in (*_SHAPES, "structure"):
        return None
    shape, _, objects = head.partition(" of ")
    return {"head": f"{shape} of {objects}", **{_key(cell): cell for cell in parts[0][1:]}}


def _parts(label: str) -> list[list[str]]:
    """Return the parts of a label and their cells; a comma between indices divides no cells."""
    return [re.split(r", (?!\d)", part.strip()) for part in label.strip(" .").split(";")]


def _key(cell: str) -> str:
    """Return what a cell sets: "left" the x position, "gap 3 cm" the gap."""
    for slot, values in LEGAL_VALUES.items():
        if cell in values:
            return slot
    return cell.split(" ")[0]


def _change_of(row: GoalCorrection) -> _Change | None:
    """Return what a correction of one structure changes in it; `None` for other corrections."""
    before, after = _structure(row.before), _structure(row.after)
    if before is None or after is None:
        return None
    (old, _, objects), (new, _, same) = (cells["head"].partition(" of ") for cells in (before, after))  # type: ignore[union-attr]
    changed = {key: (before.get(key), after.get(key)) for key in {**before, **after} if key != "head"}
    changed = {key: pair for key, pair in changed.items() if pair[0] != pair[1]}
    if objects != same or any("{" in f"{cell}" for pair in changed.values() for cell in pair):
        return None
    if old != new:
        changed["shape"] = (old, new)
    return _Change(row, old, changed) if changed else None


def _objects(label: str) -> set[int]:
    """Return the indices of the objects in a label."""
    return {int(number) for group in re.findall(r"\{([\d,]*)\}", label) for number in group.split(",") if number}


def _kinds(label: str) -> set[str]:
    """Return the words for the shapes of a label."""
    return {word for part in _parts(label) for word in part[0].partition(" of ")[0].split() if word in _SHAPE_WORDS}


def _nouns(scene: str, indices: set[int] | None = None) -> set[str]:
    """Return the words for some objects of a scene, or for all: nouns in both numbers, and colours."""
    words = set()
    for index, each in enumerate(goal_scenes()[scene]):
        if indices is None or index in indices:
            head = read_name(each.name).head or "object"
            words |= {head, plural(head), *each.name.replace("_", " ").split()}
    return words


def _names_objects(row: GoalCorrection) -> bool:
    """Return whether a text speaks of objects of its scene, by a phrase of its labels or a noun."""
    phrases = {word for label in (row.before, row.after) for phrase in _phrases(label) for word in words_of(phrase)}
    return bool(set(words_of(row.text)) & ((phrases | _nouns(row.scene)) - _PLAIN_WORDS))


def _phrases(label: str) -> list[str]:
    return re.findall(r"(?:of|\+|around) ([^{}+;,]+?) ?\{", label)


def _of_any_goal(row: GoalCorrection) -> bool:
    """Return whether a text may be said of any goal: it speaks neither of objects nor of a shape."""
    return not _names_objects(row) and not set(words_of(row.text)) & _SHAPE_WORDS
