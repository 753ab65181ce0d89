"""Turn the labelled instructions of `language/goal_lines.tsv` into the lines that the language model should write.

A line has the keywords and words that the goal network should write, in the same order, without objects that stay where
they are. A label that this cannot hold, as with a length that the grammar of lengths does not read, has no line.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from grounding.goal_network.vocabulary import END, HEADS, KEYWORD, KEYWORDS, NO_GOAL, START
from grounding.language_model.goal_lines import EVERYTHING, Said, pieces_of
from grounding.language_model.local_goals import said_counts, said_lengths
from grounding.training.goal_lines import LabelError, LabelledGoal, goal_lines, labelled
from grounding.training.goal_reader import held_out

_SPELT = {"ascending": " up", "descending": " down", "(all)": EVERYTHING, "rel in": ", inside"}


@dataclass(frozen=True)
class GoalSentence:
    """An instruction and its line.

    Attributes:
        text: the instruction.
        said: its words, lengths and counts.
        line: the correct answer of the language model.
    """

    text: str
    said: Said
    line: str


def adapter_sentences(seen: bool) -> list[GoalSentence]:
    """Return the labelled instructions that have a line.

    Args:
        seen: those to train on, or else those that are never trained on.
    """
    found = []
    for row in goal_lines():
        if held_out(row) != seen:
            try:
                found.append(goal_sentence(row.text, row.label))
            except LabelError:
                continue
    return found


def goal_sentence(text: str, label: str) -> GoalSentence:
    """Make the language model's task of an instruction and its label.

    Raises:
        LabelError: for a label that no line of the language model holds.
    """
    said = Said.of(text, tuple(said_lengths(text)), said_counts(text))
    parts = _parts(labelled(text, label))
    moved = [part for part in parts if not part.startswith("keep of ")]
    if not moved or (len(moved) < len(parts) and EVERYTHING in "".join(moved)):
        raise LabelError("a line cannot say which objects stay where they are")
    line = f" {'; '.join(moved)}."
    try:
        pieces_of(line, said)
    except ValueError as error:
        raise LabelError(str(error)) from error
    return GoalSentence(text, said, line)


def _parts(task: LabelledGoal) -> list[str]:
    """Write what the goal network should write as the parts of a line."""
    parts: list[str] = []
    before = KEYWORD
    for (kind, at), (_, end) in pairwise(task.steps):
        if kind == KEYWORD:
            keyword = KEYWORDS[at[0]]
            if keyword in HEADS or keyword in NO_GOAL:
                parts.append(keyword)
            else:
                parts[-1] += _spelt(keyword, parts[-1].startswith("place of"))
        elif kind == START:
            words = Said.of(" ".join(task.words[at[0] : end[0] + 1])).text
            parts[-1] += f" + {words}" if before == END else f" {words}"
        before = kind
    return parts


def _spelt(keyword: str, placed: bool) -> str:
    """Write a keyword of the goal network as a line has it."""
    first, _, rest = keyword.partition(" ")
    if keyword in _SPELT:
        return _SPELT[keyword]
    if first in ("x", "y", "count"):
        return f" {rest}" if placed or first == "count" else f", {rest}"
    if first in ("structure", "from"):
        return f" {keyword}"
    return f", {rest}" if first in ("size", "rel", "move") else f", {keyword}"
