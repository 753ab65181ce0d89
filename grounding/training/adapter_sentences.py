"""Turn the labelled instructions of `language/goal_lines.tsv` into the lines that the language model should write.

The labels are those of the goal network (`grounding.training.goal_lines`). A line is written in one way only: in small
letters, with the keys of a part in the order of `grounding.llm_goals.lines`, and without objects that stay where they
are. A label that this cannot hold, as with a length that the grammar of lengths does not read, has no line.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from grounding.llm_goals.lines import EVERYTHING, NO_GOAL, Said, pieces_of
from grounding.llm_goals.local import said_counts, said_lengths
from grounding.spec import LEGAL_VALUES, X_POSITIONS
from grounding.training.goal_lines import LabelError, goal_lines
from grounding.training.goal_reader import held_out
from grounding.training.goal_sentences import GoalSentence, GoalSentences

DRAWN = 0.2  # share of the sentences that are drawn
_BRACES = re.compile(r" ?\{[^}]*\}")
_NUMBERED = re.compile(r"structure \d")
# The order of a structure's keys in a line.
_KEYS = ("size", "x_position", "y_position", "facing", "order", "gap", "radius", "length", "rows", "columns", "around",
         "along", "group")  # fmt: skip
_SLOT_OF = {value: slot for slot in ("size", "x_position", "y_position") for value in LEGAL_VALUES[slot] if value}
_COPIED = ("gap", "radius", "length", "distance", "around")  # keys before words of the instruction


def adapter_sentences(seen: bool) -> list[GoalSentence]:
    """Return the labelled instructions that have a line.

    Args:
        seen: those to train on, or else those that are never trained on.
    """
    found = []
    for row in goal_lines():
        if held_out(row) == seen:
            continue
        try:
            found.append(goal_sentence(row.text, row.label))
        except LabelError:
            continue
    return found


def mixed_sentences(rng: np.random.Generator, drawn: float = DRAWN) -> Iterator[GoalSentence]:
    """Return sentences without end: labelled ones, each once in every round, and drawn ones with this probability."""
    templates, labelled = GoalSentences(rng), adapter_sentences(seen=True)
    left: list[int] = []
    while True:
        if rng.random() < drawn:
            yield templates.draw()
            continue
        left = left or rng.permutation(len(labelled)).tolist()
        yield labelled[left.pop()]


def goal_sentence(text: str, label: str) -> GoalSentence:
    """Make the language model's task of an instruction and its label.

    Raises:
        LabelError: for a label that no line of the language model holds.
    """
    lengths, counts = tuple(said_lengths(text)), said_counts(text)
    label = _BRACES.sub("", label).strip().rstrip(".").strip()
    if label in NO_GOAL:
        return GoalSentence(text, f" {label}.", lengths, counts)
    parts = [part.strip() for part in label.split(";")]
    moved = [part for part in parts if not part.startswith("keep of ")]
    if not moved or (len(moved) < len(parts) and EVERYTHING in label):
        raise LabelError("a line cannot say which objects stay where they are")
    line = f" {'; '.join(map(_part, moved))}."
    try:
        pieces_of(line, Said.of(text, lengths, counts))
    except ValueError as error:
        raise LabelError(str(error)) from error
    return GoalSentence(text, line, lengths, counts)


def _part(part: str) -> str:
    """Write a part with its keys in order and its objects in small letters."""
    cells = [cell.strip() for cell in part.split(",")]
    head, _, objects = cells[0].partition(" of ")
    first = f"{head} of {_objects(objects)}"
    if head == "place":
        return ", ".join([first, *map(_relation, cells[1:])])
    if head in ("move", "swap"):
        return ", ".join([first, *map(_copied, cells[1:])])
    keys = sorted(((_rank(cell), cell) for cell in cells[1:]), key=lambda pair: pair[0])
    return ", ".join([first, *(_key(cell) for _, cell in keys)])


def _rank(cell: str) -> int:
    name = _SLOT_OF.get(cell) or cell.partition(" ")[0]
    if name not in _KEYS:
        raise LabelError(f"there is no key {cell!r}")
    return _KEYS.index(name)


def _key(cell: str) -> str:
    name = cell.partition(" ")[0]
    return _copied(cell) if name in _COPIED else cell


def _relation(cell: str) -> str:
    if cell.startswith("at "):
        return " ".join(["at", *sorted(cell.split()[1:], key=lambda value: value not in X_POSITIONS)])
    if cell.startswith("distance "):
        return _copied(cell)
    for relation in ("left of", "right of", "in front of", "behind", "next to", "between", "on", "inside"):
        if cell.startswith(f"{relation} "):
            return f"{relation} {_objects(cell.removeprefix(relation))}"
    raise LabelError(f"there is no relation {cell!r}")


def _copied(cell: str) -> str:
    """Write a keyword and the instruction's words after it."""
    name, _, words = cell.partition(" ")
    return f"{name} {_words(words)}"


def _objects(said: str) -> str:
    said = said.strip()
    if said == EVERYTHING.strip() or _NUMBERED.fullmatch(said):
        return said
    return " + ".join(_words(phrase) for phrase in said.split(" + "))


def _words(said: str) -> str:
    return Said.of(said).text
