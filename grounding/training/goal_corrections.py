"""Turn labelled corrections into tasks of the goal network: the goal so far in words, what is said, the goal after it.

A row of `language/goal_corrections.tsv.xz` has a scene, the label of the goal so far, what is said, and the label of
the goal after it, or "computed.", where that needs a length or a place that only the arrangement shown has.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.beam_search import WrittenGoal
from grounding.goal_network.goal_rendition import ObjectPhrase, Rendition, in_centimetres, rendition_of
from grounding.goal_network.parts import UnreadLengthError, parts_of
from grounding.goal_network.vocabulary import HEADS, NO_GOAL, PLACED, STRUCTURE_HEADS, Action
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.resolve.measures import lengths_of
from grounding.resolve.tokens import split, words_of
from grounding.spec import SpecError
from grounding.training.goal_lines import GoalLine, LabelError, LabelledGoal, labelled, labelled_rows, plain_label

_NUMBERS = re.compile(r"\{(\d+(?:,\d+)*)\}")
_NAMED = re.compile(r"(?P<words>[^{}]+?) ?\{(?P<numbers>[\d|]+)\}")
_LENGTH = re.compile(
    r"(?P<key>gap|radius|length|distance|left|right|closer|away) (?!of )(?P<words>[^{}]+?)(?: ?\{(?P<metres>[\d.]+)\})?"
)
_REFERENCE = re.compile(rf"(?P<key>around|inside|{'|'.join(one for one in PLACED if one != 'in')}) (?P<objects>.*)")
_PRONOUNS = frozenset(
    (
        "it",
        "them",
        "they",
        "these",
        "those",
        "this",
        "that",
        "him",
        "her",
        "this one",
        "that one",
        "the former",
        "the latter",
        *(f"{which} {many}" for which in ("these", "those") for many in ("ones", "two", "three", "four")),
        "the pair",
        "the two",
        "the three",
        "both",
        "both of them",
        "all of them",
    )
)
UNDECIDED = "unclear"  # what the network writes where the new value has to be computed


@dataclass(frozen=True)
class GoalCorrection:
    """A row of `language/goal_corrections.tsv.xz`.

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
    return tuple(GoalCorrection(*row) for row in labelled_rows("goal_corrections"))


def corrected(row: GoalCorrection) -> LabelledGoal:
    """Make the network's task of a row.

    Raises:
        LabelError: for labels that are not legal, or that name other objects than the network can point at.
    """
    rendition, label = rewritten(row)
    return labelled(f"{rendition.text} {row.text}", label, rendition.length, row.scene)


def rewritten(row: GoalCorrection) -> tuple[Rendition, str]:
    """Return the goal so far in words, and the label of the goal after it in these words and those of what is said."""
    scene = goal_scenes()[row.scene]
    rendition = rendition_of(goal_of(row.before, len(scene)), scene)
    after = plain_label(row.after)
    if after in (*NO_GOAL, "computed"):
        return rendition, UNDECIDED if after == "computed" else after
    said = f" {' '.join(words_of(row.text))} "
    parts = _parts(row.after)
    # What was kept before already is no part of a goal.
    kept = {place: [each for each in _named(part[0]) if f" {each[0]} " in said]
            for place, part in enumerate(parts) if part[0].startswith("keep of")}  # fmt: skip
    indices = {index for named in kept.values() for _, each in named for index in each}
    written = [part for place, part in enumerate(parts) if kept.get(place, True)]
    if len(written) < len(parts):
        written = _of_the_rest(written, row.after, len(scene))
    cells = ([_rewritten(cell, rendition, said, indices) for cell in part] for part in written)
    return rendition, "; ".join(map(", ".join, cells))


def _of_the_rest(parts: Sequence[Sequence[str]], label: str, count: int) -> list[list[str]]:
    """Return the parts of a label with the objects themselves in place of "(all)":
    something is kept that is not said again.
    """
    structures = iter(goal_of(label, count).structures)
    found = []
    for head, *cells in parts:
        name = head.removesuffix(" (all)")
        made = next(structures) if any(head.startswith(each) for each in STRUCTURE_HEADS) else None
        if made is not None and name != head and made.objects is not None:
            head = f"{name} the rest {{{'|'.join(map(str, made.objects))}}}"
        found.append([head, *cells])
    return found


def goals_of(row: GoalLine | GoalCorrection) -> tuple[Goal, Goal | None]:
    """Return the goal so far and the goal that is meant by a labelled text; `None` where no goal holds it.

    Raises:
        LabelError: for labels that are not legal.
    """
    count = len(goal_scenes()[row.scene])
    label, before = (row.after, goal_of(row.before, count)) if isinstance(row, GoalCorrection) else (row.label, Goal())
    return before, None if plain_label(label) in (*NO_GOAL, "computed") else goal_of(label, count)


def goal_of(label: str, count: int | None = None) -> Goal:
    """Return the goal of a label with the indices of objects.

    Args:
        label: with the indices in braces.
        count: of objects in the scene: "(all)" is then without those that are kept; `None` does not count these.

    Raises:
        LabelError: for a label that is not legal.
    """
    cells = _parts(label)
    numbers: dict[str, list[int]] = {}
    for words, indices in (each for part in cells for cell in part for each in _named(cell)):
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
    kept = [index for part in cells if part not in parts for _, each in _named(part[0]) for index in each]
    return goal if count is None or not kept else _without(goal, count, kept)


def _without(goal: Goal, count: int, kept: Sequence[int]) -> Goal:
    """Write out the objects of structures without those that are kept."""
    taken = {*goal.named_objects(), *kept}
    rest = tuple(index for index in range(count) if index not in taken)
    return Goal(tuple(_of_others(part, rest, kept) if isinstance(part, StructurePart) else part for part in goal.parts))


def _of_others(part: StructurePart, rest: Sequence[int], kept: Sequence[int]) -> StructurePart:
    """Return a structure without what is kept; of "(all)" the rest is left."""
    named: Sequence[int | str] = rest if part.objects is None else part.objects
    return replace(part, objects=tuple(index for index in named if index not in kept) or part.objects)


def _with_numbers(part: Mapping[str, object], numbers: Mapping[str, list[int]]) -> dict[str, object]:
    found = dict(part)
    for key in ("objects", "reference", "around"):
        if isinstance(words := found.get(key), list):
            found[key] = [index for phrase in words for index in numbers[phrase]]
    return found


def _parts(label: str) -> list[list[str]]:
    """Divide a label into parts and their cells; between the indices of objects there is "|" then."""
    marked = _NUMBERS.sub(lambda found: "{" + found[1].replace(",", "|") + "}", label.strip().rstrip(".").strip())
    return [[cell.strip() for cell in part.split(",")] for part in marked.split(";")]


def _objects_of(cell: str) -> tuple[str, str]:
    """Divide a cell into its keyword and its phrases for objects, "" where it has none."""
    head, of, objects = cell.partition(" of ")
    if of and f"{head} of" in HEADS:
        return f"{head} of", objects
    found = _REFERENCE.fullmatch(cell)
    return (found["key"], found["objects"]) if found else (cell, "")


def _named(cell: str) -> list[tuple[str, list[int]]]:
    """Return the phrases of a cell with the indices of their objects."""
    found = [_NAMED.fullmatch(phrase.strip()) for phrase in _objects_of(cell)[1].split(" + ")]
    return [(" ".join(words_of(one["words"])), [int(n) for n in one["numbers"].split("|")]) for one in found if one]


def _plain_cell(cell: str, said: str = "") -> str:
    """Return a cell without indices, its length in centimetres where the label gives metres or it is not said so."""
    length = _LENGTH.fullmatch(cell)
    if length is None or (said and f" {' '.join(words_of(length['words']))} " in said):
        return plain_label(cell)
    if length["metres"] or said:
        metres = float(length["metres"]) if length["metres"] else _metres(length["words"])
        return f"{length['key']} {in_centimetres(metres)}"
    return plain_label(cell)


def _rewritten(cell: str, rendition: Rendition, said: str, kept: Set[int]) -> str:
    """Return a cell in the words of a rendition and of what is said."""
    head, objects = _objects_of(cell)
    if "{" not in objects:
        return _plain_cell(cell, said)
    named = _named(cell)
    # What a pronoun stands for is said by the goal so far.
    pointed = {words for words, indices in named if words.lower() in _PRONOUNS and _stands_in(rendition, indices)}
    new = [words for words, _ in named if f" {words} " in said and words not in pointed]
    old = {index for words, indices in named if words not in new for index in indices}
    covering = [one for one in rendition.phrases.values() if set(one.objects) & old]
    inside = [one for one in covering if set(one.objects) <= old]
    covering = inside if {index for one in inside for index in one.objects} == old else covering
    covered = {index for one in covering for index in one.objects}
    in_order = list[str]()
    for words, indices in named:
        phrases = sorted(
            (one for one in covering if set(one.objects) & set(indices)), key=lambda one: _first(one, indices)
        )
        in_order += [words] if words in new else [one.words for one in phrases]
    if covered - old and not (head.endswith(" of") and covered - old <= kept):
        raise LabelError(f"no phrase of the goal stands for objects {sorted(old)}")
    if not old <= covered:
        raise LabelError(f"the goal so far does not have objects {sorted(old)}")
    return f"{head} {' + '.join(dict.fromkeys(in_order))}"


def _first(phrase: ObjectPhrase, indices: Sequence[int]) -> int:
    """Return the place of the first of some objects that a phrase stands for."""
    return min(place for place, index in enumerate(indices) if index in phrase.objects)


def _stands_in(rendition: Rendition, indices: Sequence[int]) -> bool:
    """Return whether phrases of a rendition stand for some objects, and no others."""
    inside = [one.objects for one in rendition.phrases.values() if set(one.objects) <= set(indices)]
    return {index for one in inside for index in one} == set(indices)


def _metres(words: str) -> float:
    lengths = lengths_of(split(words))
    if not lengths:
        raise LabelError(f"{words!r} is no length")
    return abs(next(iter(lengths.values()))[0])


# How people begin when they want something else, or something more. What is said about other objects, without such a
# beginning, is more.
_ANEW = ("scrap that, ", "forget that. ", "new idea: ", "start over: ", "no, do something else. ")
_MORE = (
    "",
    "",
    "",
    "",
    "also ",
    "and ",
    "and then ",
    "plus ",
    "then ",
    "in addition, ",
    "oh and ",
    "next, ",
    "and also ",
)


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
        label = plain_label(line.label)
        apart = label not in NO_GOAL and _apart(goal, goal_of(line.label))
        starts: tuple[str, ...] = _ANEW if apart else ("", *_ANEW)
        if apart and self.rng.random() < 0.7:
            before = len(goal.structures)
            later = re.sub(r"structure (\d)", lambda found: f"structure {int(found[1]) + before}", label)
            label, starts = f"{rendition.label}; {later}", _MORE
        text = f"{starts[self.rng.integers(len(starts))]}{line.text}"
        return labelled(f"{rendition.text} {text}", label, rendition.length, line.scene)


def _apart(goal: Goal, other: Goal) -> bool:
    """Return whether two goals speak of different objects, none of all that there are."""
    everything = any(part.objects is None for one in (goal, other) for part in one.structures)
    return not everything and not set(goal.named_objects()) & set(other.named_objects())
