"""Let a shape that the networks were not taught be read as one that they were: a new shape, or a figure, needs no
training.

Where a text names it, and in the goal so far, the noun of the taught shape that takes the most alike slots and keys,
and that the text does not speak of, takes its place; the goal that is written gets the shape back.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import Any

from grounding.goal_network.vocabulary import TAUGHT_SHAPES
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.propose.figure_mentions import Mention
from grounding.structure_words import STRUCTURES, words_of


@dataclass(frozen=True)
class StandIns:
    """The taught shapes that stand for others in one text.

    Attributes:
        said: the text.
        mentions: where it names the others.
        shapes: other shape -> taught shape, also of those that only the goal so far has.
    """

    said: str = ""
    mentions: tuple[Mention, ...] = ()
    shapes: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, text: str, figures: Sequence[Mention] = (), before: Goal = Goal(), number: int = 0) -> StandIns:
        """Choose the stand-ins of a text and of the goal that it is about.

        Args:
            text: any string.
            figures: that the text names.
            before: the goal so far.
            number: which of the taught shapes that are alike stand for the others, from 0.
        """
        there = {part.shape for part in before.structures if part.shape is not None}
        mentions = (*figures, *_of_new_shapes(text))
        wanted = {*(one.name for one in mentions), *there}.difference(TAUGHT_SHAPES)
        spoken = there.union(shape for shape in TAUGHT_SHAPES if _nouns(shape).search(text))
        shapes: dict[str, str] = {}
        for shape in sorted(wanted):
            free = [one for one in TAUGHT_SHAPES if one not in spoken and one not in shapes.values()]
            asked = {
                key
                for part in before.structures
                if part.shape == shape
                for key in (*dict(part.spec.tokens()), *part.keys)
            }
            if free:
                alike = sorted(free, key=partial(_difference, shape, asked - {"shape"}))
                shapes[shape] = alike[min(number, len(alike) - 1)]
        return cls(text, tuple(one for one in mentions if one.name in shapes), shapes)

    @property
    def text(self) -> str:
        """Return the text with the nouns of the taught shapes."""
        found, end = "", 0
        for one in sorted(self.mentions, key=lambda each: each.first):
            noun = self.noun(one.name)
            found += self.said[end : one.first]
            article = re.search(r"\b[Aa]n?(?= $)", found)
            if article is not None:
                found = f"{found[: article.start() + 1]}{'n' if noun[0] in 'aeiou' else ''} "
            found += " ".join(
                filter(None, (one.lead and re.sub(r"\ba$", "an" if noun[0] in "aeiou" else "a", one.lead), noun))
            )
            end = one.end
        return found + self.said[end:]

    def noun(self, shape: str) -> str:
        """Return the noun that stands for a shape."""
        return STRUCTURES[self.shapes[shape]].words.nouns[0]

    def in_own_words(self, words: str) -> str:
        """Return words of the text that was read, with what was said in place of the taught nouns."""
        for one in self.mentions:
            said = self.said[one.first : one.end]
            words = re.sub(rf"\b{re.escape(self.noun(one.name))}\b", said.replace("\\", r"\\"), words)
        return words

    def goal(self, goal: Goal) -> Goal:
        """Return a goal with the taught shapes."""
        return Goal(tuple(
            replace(part, shape=self.shapes.get(part.shape or "", part.shape))
            if isinstance(part, StructurePart)
            else part
            for part in goal.parts
        ))  # fmt: skip

    def parts(self, written: tuple[dict[str, Any], ...]) -> tuple[dict[str, Any], ...]:
        """Return the parts that the network wrote with the new shapes in their place."""
        back = {taught: shape for shape, taught in self.shapes.items()}
        return tuple(
            part | {"shape": back.get(part["shape"], part["shape"])} if "shape" in part else part for part in written
        )

    def are_objects(self, phrases: Sequence[str]) -> bool:
        """Return whether phrases for objects have the noun of a stand-in: what it stands for is no structure."""
        nouns = {self.noun(one.name) for one in self.mentions}
        return any(re.search(rf"\b{re.escape(noun)}s?\b", phrase) for noun in nouns for phrase in phrases)


def _of_new_shapes(text: str) -> tuple[Mention, ...]:
    """Find the nouns of shapes with a file of words that the network was not taught."""
    new = [shape for shape in STRUCTURES if shape not in TAUGHT_SHAPES]
    return tuple(Mention(*found.span(), shape) for shape in new for found in _nouns(shape).finditer(text))


def _difference(shape: str, asked: Collection[str], taught: str) -> tuple[int, bool, int, int]:
    """Return how unlike two shapes are: how much of what was asked for the taught one cannot carry, whether one alone
    stands in layers, how many slots and keys the taught one lacks, and how many it alone takes.
    """
    one, other = words_of(shape), STRUCTURES[taught]
    own, carried = {*one.slots, *one.keys}, {*other.slots, *other.keys}
    return len(set(asked) - carried), one.stacked != other.stacked, len(own - carried), len(carried - own)


@cache
def _nouns(shape: str) -> re.Pattern[str]:
    """Return the pattern of a shape's nouns, plurals included."""
    words = "|".join(sorted(map(re.escape, (shape, *STRUCTURES[shape].words.nouns)), key=len, reverse=True))
    return re.compile(rf"\b(?:{words})(?:e?s)?\b", re.IGNORECASE)
