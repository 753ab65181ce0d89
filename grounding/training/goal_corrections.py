"""Turn labelled corrections into tasks of the goal network: the goal so far in words, what is said, the goal after it.

A row of `language/goal_corrections.tsv` has a scene, the label of the goal so far, what is said, and the label of the
goal after it, or "computed.", where that needs a length or a place that only the arrangement shown has.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources

import numpy as np

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.goal_rendition import Rendition, in_centimetres, rendition_of
from grounding.goal_network.parts import UnreadLengthError, parts_of
from grounding.goal_network.vocabulary import HEADS, NO_GOAL, PLACED, Action
from grounding.goal_network.writer import WrittenGoal, words_of
from grounding.goal_reading.measures import lengths_of
from grounding.goal_reading.tokens import split
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.spec import SpecError
from grounding.training.goal_lines import GoalLine, LabelError, LabelledGoal, labelled

_NUMBERS = re.compile(r"\{(\d+(?:,\d+)*)\}")
_NAMED = re.compile(r"(?P<words>[^{}]+?) ?\{(?P<numbers>[\d|]+)\}")
_LENGTH = re.compile(
    r"(?P<key>gap|radius|length|distance|left|right|closer|away) (?!of )(?P<words>[^{}]+?)(?: ?\{(?P<metres>[\d.]+)\})?"
)
_REFERENCE = re.compile(rf"(?P<key>around|inside|{'|'.join(one for one in PLACED if one != 'in')}) (?P<objects>.*)")
UNDECIDED = "unclear"  # what the network writes where the new value has to be computed


@dataclass(frozen=True)
class GoalCorrection:
    """A row of `language/goal_corrections.tsv`.

    Attributes:
        scene: name of the scene (`benchmark_data/goal_scenes.json`).
        before: label of the goal so far, with the indices of objects in braces.
        text: what is said.
        after: label of the goal after it, an answer of `NO_GOAL`, or "computed.".
    """

    scene: str
    before: str
    text: str
    after: str


@cache
def goal_corrections() -> tuple[GoalCorrection, ...]:
    """Load the labelled corrections that come with the project."""
    text = (resources.files("grounding") / "language" / "goal_corrections.tsv").read_text(encoding="utf-8")
    return tuple(GoalCorrection(*row) for row in csv.reader(text.splitlines(), delimiter="\t", quoting=csv.QUOTE_NONE))


@dataclass(frozen=True)
class CorrectedGoal:
    """What the network is given of a correction.

    Attributes:
        goal: the goal so far.
        rendition: it in words.
        text: what is said.
        label: of the goal after it, in words of the rendition and of what is said.
        scene: name of the scene.
    """

    goal: Goal
    rendition: Rendition
    text: str
    label: str
    scene: str

    @property
    def task(self) -> LabelledGoal:
        """Return the network's task.

        Raises:
            LabelError: for a label that the network cannot write.
        """
        return labelled(f"{self.rendition.text} {self.text}", self.label, self.rendition.length, self.scene)


def corrected(row: GoalCorrection) -> CorrectedGoal:
    """Make what the network is given of a row.

    Raises:
        LabelError: for labels that are not legal, or that name other objects than the network can point at.
    """
    objects = goal_scenes()[row.scene]
    goal = goal_of(row.before)
    rendition = rendition_of(goal, objects)
    after = row.after.strip().rstrip(".").strip()
    if after == "computed":
        after = UNDECIDED
    if after not in NO_GOAL:
        after = _Rewriting(rendition, row.text).label(after)
    return CorrectedGoal(goal, rendition, row.text, after, row.scene)


def goal_of(label: str, count: int | None = None) -> Goal:
    """Return the goal of a label with the indices of objects.

    Args:
        label: with the indices in braces.
        count: of objects in the scene: "(all)" is then without those that are kept; `None` does not count these.

    Raises:
        LabelError: for a label that is not legal.
    """
    cells = [[cell.strip() for cell in part.split(",")] for part in _marked(label).split(";")]
    numbers: dict[str, list[int]] = {}
    for words, indices in (each for part in cells for cell in part for each in _named(_objects_of(cell)[1])):
        if numbers.setdefault(words, indices) != indices:
            raise LabelError(f"{words!r} stands for two things")
    parts = [part for part in cells if not part[0].startswith("keep of")]
    text = "; ".join(", ".join(map(_plain_cell, part)) for part in parts)
    task = labelled(text, text)
    actions = tuple(Action(kind, at[0]) for kind, at in task.steps[:-1])
    try:
        read = parts_of(WrittenGoal(task.words, actions, 1.0), text)
        goal = Goal.from_dict({"parts": [_with_numbers(part, numbers) for part in read.parts]})
    except (UnreadLengthError, SpecError, KeyError) as error:
        raise LabelError(f"{label!r} is no goal: {error}") from error
    kept = [index for part in cells if part not in parts for _, each in _named(_objects_of(part[0])[1]) for index in each]
    return goal if count is None or not kept else _without(goal, count, kept)


def _without(goal: Goal, count: int, kept: Sequence[int]) -> Goal:
    """Write out the objects of structures without those that are kept."""
    taken = {*goal.named_objects(), *kept}
    rest = tuple(index for index in range(count) if index not in taken)
    return Goal(tuple(_of_others(part, rest, kept) if isinstance(part, StructurePart) else part for part in goal.parts))


def _of_others(part: StructurePart, rest: Sequence[int], kept: Sequence[int]) -> StructurePart:
    """Return a structure without what is kept; of "(all)" the rest is left."""
    named = rest if part.objects is None else part.objects
    return replace(part, objects=tuple(index for index in named if index not in kept) or part.objects)


def _with_numbers(part: Mapping[str, object], numbers: Mapping[str, list[int]]) -> dict[str, object]:
    found = dict(part)
    for key in ("objects", "reference", "around"):
        if isinstance(words := found.get(key), list):
            found[key] = [index for phrase in words for index in numbers[phrase]]
    return found


def _marked(label: str) -> str:
    """Return a label whose commas stand between cells only."""
    return _NUMBERS.sub(lambda found: "{" + found[1].replace(",", "|") + "}", label.strip().rstrip(".").strip())


def _objects_of(cell: str) -> tuple[str, str]:
    """Divide a cell into its keyword and its phrases for objects, "" where it has none."""
    head, of, objects = cell.partition(" of ")
    if of and f"{head} of" in HEADS:
        return f"{head} of", objects
    found = _REFERENCE.fullmatch(cell)
    return (found["key"], found["objects"]) if found else (cell, "")


def _named(objects: str) -> list[tuple[str, list[int]]]:
    """Return the phrases of a cell with the indices of their objects."""
    found = [_NAMED.fullmatch(phrase.strip()) for phrase in objects.split(" + ")]
    return [(" ".join(words_of(one["words"])), [int(n) for n in one["numbers"].split("|")]) for one in found if one]


def _plain_cell(cell: str) -> str:
    """Return a cell without indices, its length in centimetres where the label gives metres."""
    length = _LENGTH.fullmatch(cell)
    if length and length["metres"]:
        return f"{length['key']} {in_centimetres(float(length['metres']))}"
    return re.sub(r" ?\{[^}]*\}", "", cell)


class _Rewriting:
    """Rewrites a label in the words of a rendition and of what is said."""

    def __init__(self, rendition: Rendition, text: str) -> None:
        self.rendition = rendition
        self.said = f" {' '.join(words_of(text))} "

    def label(self, after: str) -> str:
        parts = [[cell.strip() for cell in part.split(",")] for part in _marked(after).split(";")]
        keeping = [each for part in parts if part[0].startswith("keep of") for each in _named(_objects_of(part[0])[1])]
        kept = [index for words, indices in keeping if self.says(words) for index in indices]
        written = (", ".join(self.cell(cell, kept) for cell in part) for part in parts if self.stays(part[0]))
        return "; ".join(written)

    def stays(self, cell: str) -> bool:
        """Return whether a part is written: what was kept before is no part of a goal."""
        return not cell.startswith("keep of") or any(self.says(words) for words, _ in _named(_objects_of(cell)[1]))

    def says(self, words: str) -> bool:
        return f" {words} " in self.said

    def cell(self, cell: str, kept: Sequence[int]) -> str:
        head, objects = _objects_of(cell)
        if objects and "{" in objects:
            return f"{head} {' + '.join(self.phrases(_named(objects), kept, head))}"
        length = _LENGTH.fullmatch(cell)
        if length and not self.says(" ".join(words_of(length["words"]))):
            metres = float(length["metres"]) if length["metres"] else _metres(length["words"])
            return f"{length['key']} {in_centimetres(metres)}"
        return re.sub(r" ?\{[^}]*\}", "", cell)

    def phrases(self, named: Sequence[tuple[str, list[int]]], kept: Sequence[int], head: str) -> list[str]:
        """Return the phrases to point at for some objects."""
        found = [words for words, _ in named if self.says(words)]
        old = {index for words, indices in named if not self.says(words) for index in indices}
        covering = [one for one in self.rendition.phrases.values() if set(one.objects) & old]
        inside = [one for one in covering if set(one.objects) <= old]
        if {index for one in inside for index in one.objects} == old:
            covering = inside
        more = {index for one in covering for index in one.objects} - old
        if more and not (head.endswith(" of") and more <= set(kept)):
            raise LabelError(f"no phrase of the goal stands for objects {sorted(old)}")
        if not old <= {index for one in covering for index in one.objects}:
            raise LabelError(f"the goal so far does not have objects {sorted(old)}")
        return [*dict.fromkeys(one.words for one in covering), *found]


def _metres(words: str) -> float:
    lengths = lengths_of(split(words))
    if not lengths:
        raise LabelError(f"{words!r} is no length")
    return abs(next(iter(lengths.values()))[0])


# How people begin when they want something else, or something more.
_ANEW = ("", "", "", "scrap that, ", "forget that. ", "new idea: ", "start over: ", "no, do something else. ")
_MORE = ("also ", "and ", "and then ", "plus ", "then ", "in addition, ", "oh and ", "next, ", "and also ")


class DrawnCorrections:
    """Corrections that are drawn: a whole instruction that is said about another goal, in its place or besides it.

    Args:
        lines: labelled instructions.
        rng: draws.
    """

    def __init__(self, lines: Sequence[GoalLine], rng: np.random.Generator) -> None:
        self.rng, self.lines = rng, list(lines)
        self.goals: dict[str, list[Goal]] = {}
        for line in lines:
            try:
                self.goals.setdefault(line.scene, []).append(goal_of(line.label))
            except LabelError:
                continue  # an answer in place of a goal, or a label that the network cannot write

    def draw(self) -> LabelledGoal:
        """Draw a task."""
        while True:
            line = self.lines[self.rng.integers(len(self.lines))]
            goals = self.goals.get(line.scene, [])
            if not goals:
                continue
            try:
                return self._task(goals[self.rng.integers(len(goals))], line)
            except LabelError:
                continue

    def _task(self, goal: Goal, line: GoalLine) -> LabelledGoal:
        rendition = rendition_of(goal, goal_scenes()[line.scene])
        label = re.sub(r" ?\{[^}]*\}", "", line.label).strip().rstrip(".").strip()
        starts = _ANEW
        if label not in NO_GOAL and self.rng.random() < 0.5 and _apart(goal, goal_of(line.label)):
            before = len(goal.structures)
            later = re.sub(r"structure (\d)", lambda found: f"structure {int(found[1]) + before}", label)
            label, starts = f"{rendition.label}; {later}", _MORE
        text = f"{starts[self.rng.integers(len(starts))]}{line.text}"
        return labelled(f"{rendition.text} {text}", label, rendition.length, line.scene)


def _apart(goal: Goal, other: Goal) -> bool:
    """Return whether two goals speak of different objects, none of all that there are."""
    everything = any(part.objects is None for one in (goal, other) for part in one.structures)
    return not everything and not set(goal.named_objects()) & set(other.named_objects())
