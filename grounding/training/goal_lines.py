"""Turn labelled instructions into the actions that the goal network should take.

A label is one line: "tower of the tins, right; place of structure 1, behind the plate." Objects and lengths are words
of the instruction. In `language/goal_lines.tsv.xz` the indices of the objects in a scene stand behind them in braces:
"tower of the tins {0,1,2}, right."
"""

from __future__ import annotations

import csv
import lzma
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.legal_actions import legal_actions
from grounding.goal_network.vocabulary import (
    END,
    HEADS,
    KEYWORD,
    KEYWORDS,
    NO_GOAL,
    NUMBER_OF,
    PLACED,
    RANK_OF,
    START,
    Action,
)
from grounding.goal_network.word_presence import word_presence
from grounding.resolve.tokens import words_of
from grounding.spec import LEGAL_VALUES

_BRACES = re.compile(r" ?\{[^}]*\}")
_SLOTS = {"size": "size", "x_position": "x", "y_position": "y"}
_KEYWORD_OF_VALUE = {value: f"{name} {value}" for slot, name in _SLOTS.items() for value in LEGAL_VALUES[slot]}
_DIRECTIONS = {"up": "ascending", "down": "descending"}

# A step: its kind, and the keyword's number or the places of words, any of which is right.
Step = tuple[int, tuple[int, ...]]


class LabelError(ValueError):
    """A label that is not legal for its instruction; the message says why."""


@dataclass(frozen=True)
class LabelledGoal:
    """An instruction and what the network should write.

    Attributes:
        words: of the instruction, in small letters.
        steps: what should be written, the end included.
        said_from: the place from which on they are said; the words before render a goal.
        presence: whether each word names something in the scene (`word_presence`); empty where no scene is known.
    """

    words: tuple[str, ...]
    steps: tuple[Step, ...]
    said_from: int = 0
    presence: tuple[int, ...] = ()


@dataclass(frozen=True)
class GoalLine:
    """A row of `language/goal_lines.tsv.xz`.

    Attributes:
        stratum: what kind of instruction it is.
        scene: name of the scene for which it was written (`benchmark_data/goal_scenes.json`).
        text: the instruction.
        label: its line, with the indices of objects in braces.
    """

    stratum: str
    scene: str
    text: str
    label: str


@cache
def goal_lines() -> tuple[GoalLine, ...]:
    """Load the labelled instructions that come with the project."""
    return tuple(GoalLine(*row) for row in labelled_rows("goal_lines"))


def labelled_rows(name: str) -> Iterator[list[str]]:
    """Read the rows of `language/NAME.tsv.xz`, which `xzcat` prints: packed, as the texts take 12 MB."""
    table = (resources.files("grounding") / "language" / f"{name}.tsv.xz").read_bytes()
    return csv.reader(lzma.decompress(table).decode().splitlines(), delimiter="\t", quoting=csv.QUOTE_NONE)


def labelled(text: str, label: str, said_from: int = 0, scene: str | None = None) -> LabelledGoal:
    """Make the network's task of an instruction and its label.

    Args:
        text: the instruction, or a rendition of a goal and what is said about it.
        label: its line.
        said_from: the place of the first word after the rendition.
        scene: name of the scene in which it is said; `None` where none is known.

    Raises:
        LabelError: for a label that the network cannot write for this instruction.
    """
    words = words_of(text)
    line = plain_label(label)
    steps = [_keyword(line)] if line in NO_GOAL else [s for part in line.split(";") for s in _part(words, part)]
    steps.append(_keyword("<end>"))
    _check(steps)
    presence = () if scene is None else word_presence(words, goal_scenes()[scene])
    return LabelledGoal(tuple(words), tuple(steps), said_from, presence)


def plain_label(label: str) -> str:
    """Return a label without the indices of objects and its full stop."""
    return _BRACES.sub("", label).strip().rstrip(".").strip()


def _keyword(name: str) -> Step:
    if name not in NUMBER_OF:
        raise LabelError(f"there is no keyword {name!r}")
    return KEYWORD, (NUMBER_OF[name],)


def _phrase(words: Sequence[str], phrase: str) -> list[Step]:
    """Point at a phrase, wherever it stands."""
    said = words_of(phrase)
    starts = [i for i in range(len(words) - len(said) + 1) if list(words[i : i + len(said)]) == said]
    if not said or not starts:
        raise LabelError(f"{phrase!r} does not stand in the instruction word for word")
    return [(START, tuple(starts)), (END, tuple(start + len(said) - 1 for start in starts))]


def _objects(words: Sequence[str], said: str) -> list[Step]:
    said = said.strip()
    if said == "(all)" or re.fullmatch(r"structure \d", said):
        return [_keyword(said)]
    return [step for phrase in said.split(" + ") for step in _phrase(words, phrase)]


def _part(words: Sequence[str], part: str) -> list[Step]:
    cells = [cell.strip() for cell in part.strip().split(",")]
    head, _, objects = cells[0].partition(" of ")
    if f"{head} of" not in HEADS:
        raise LabelError(f"there is no head {head!r}")
    steps = [_keyword(f"{head} of"), *_objects(words, objects)]
    if head == "place":
        return steps + [step for cell in cells[1:] for step in _place_key(words, cell)]
    if head == "move":
        way, _, length = cells[1].partition(" ")
        return [*steps, _keyword(f"move {way}"), *_phrase(words, length)]
    keys = [_structure_key(words, cell) for cell in cells[1:]]
    return steps + [step for _, key in sorted(keys, key=lambda pair: pair[0]) for step in key]


def _place_key(words: Sequence[str], cell: str) -> list[Step]:
    if cell.startswith("at "):
        values = sorted(cell.split()[1:], key=lambda value: value not in LEGAL_VALUES["x_position"])
        return [_keyword("at"), *(_keyword(_KEYWORD_OF_VALUE[value]) for value in values)]
    if cell.startswith("distance "):
        return [_keyword("distance"), *_phrase(words, cell.removeprefix("distance "))]
    for relation in PLACED:
        said = "inside" if relation == "in" else relation
        if cell.startswith(f"{said} "):
            return [_keyword(f"rel {relation}"), *_objects(words, cell.removeprefix(said))]
    raise LabelError(f"there is no relation {cell!r}")


def _structure_key(words: Sequence[str], cell: str) -> tuple[int, list[Step]]:
    """Return the key's place among the keys, and its steps."""
    name, _, rest = cell.partition(" ")
    if cell in _KEYWORD_OF_VALUE:
        steps = [_keyword(_KEYWORD_OF_VALUE[cell])]
    elif name == "order":
        by, *more = rest.split(" ")
        way = [_keyword(_DIRECTIONS[one]) for one in more[:1] if one in _DIRECTIONS]
        start = " ".join(more[len(way) :])
        steps = [_keyword(f"order {by}"), *way, *([_keyword(start)] if start else [])]
    elif name in ("gap", "radius", "length"):
        steps = [_keyword(name), *_phrase(words, rest)]
    elif name in ("rows", "columns"):
        steps = [_keyword(name), _keyword(f"count {rest}")]
    elif name == "around":
        steps = [_keyword(name), *_objects(words, rest)]
    else:
        steps = [_keyword(cell)]
    key = KEYWORDS[steps[0][1][0]]
    if key not in RANK_OF:
        raise LabelError(f"there is no key {cell!r}")
    return RANK_OF[key], steps


def _check(steps: Sequence[Step]) -> None:
    moves = legal_actions()
    legal = next(moves)
    for kind, options in steps:
        fits = {KEYWORD: options[0] in legal.keywords, START: legal.start, END: legal.end_from is not None}[kind]
        if not fits:
            raise LabelError(f"the label is not legal at step {steps.index((kind, options))}")
        try:
            legal = moves.send(Action(kind, options[0]))
        except StopIteration:
            return
    raise LabelError("the label has no end")
