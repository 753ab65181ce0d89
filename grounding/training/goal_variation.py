"""Vary labelled instructions: other nouns and colours, left and right exchanged, no punctuation, typing errors.

Labels point at places of words, so they stay right when words are exchanged for others.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from grounding.corpus.typos import mistyped
from grounding.goal_network.vocabulary import KEYWORD, KEYWORDS, NUMBER_OF
from grounding.resolve.word_forms import plural
from grounding.training.goal_lines import LabelledGoal, Step

MIRRORED, OTHER_NOUNS, NO_MARKS, MISTYPED, NO_SCENE = 0.3, 0.5, 0.15, 0.12, 0.15  # shares of the instructions
_NOUNS = tuple(
    "mug bowl plate spoon fork knife banana apple bottle jar box cup block ball car duck marker hammer drill "
    "screwdriver clamp kettle teapot pitcher sponge egg tube saucer tray pen carton lemon pear cube cylinder brick pot "
    "trowel stone stapler notebook phone tin glass vase candle book lamp toy bear truck shell coin key wrench brush "
    "basket".split()
)
_COLOURS = ("red", "blue", "green", "yellow", "white", "black", "brown", "grey", "pink", "purple")
_SIDES = ("left right", "left-hand right-hand", "lefthand righthand", "leftmost rightmost", "east west",
          "leftward rightward", "leftwards rightwards")  # fmt: skip
_OTHER_SIDE = {a: b for pair in _SIDES for a, b in (pair.split(), pair.split()[::-1])}
# "Left" and "right" that are no sides.
_NO_SIDE = re.compile(
    r"what(?:'s| is) left|all right|right (?:now|away|in front|behind|next|beside|here|there|on top|up|then|by|at|"
    r"after|against|under|between|angle|order|way|so|well|ok|okay|where|amount|of course)|that's right|just right|"
    r"left over|(?:is|are|left|have|has|got|been|be) left|left alone|^right\b|, right [,?.]|clockwise|right \?"
)
_MIRRORED_KEYWORDS = {
    NUMBER_OF[word]: NUMBER_OF[" ".join(_OTHER_SIDE.get(part, part) for part in word.split(" "))]
    for word in KEYWORDS
    if {"left", "right", "east", "west"} & set(word.split(" "))
}


def varied(row: LabelledGoal, rng: np.random.Generator) -> LabelledGoal:
    """Return an instruction like this one, with the label that it must have."""
    words, steps, start = list(row.words), list(row.steps), row.said_from
    presence = () if rng.random() < NO_SCENE else row.presence
    mirrored = mirrored_words(words, start, rng)
    if mirrored != words:
        words = mirrored
        steps = [(kind, (_MIRRORED_KEYWORDS.get(at[0], at[0]),) if kind == KEYWORD else at) for kind, at in steps]
    words = renamed_words(words, rng)
    if rng.random() < NO_MARKS:
        words, steps, presence = _without_marks(words, steps, presence, start)
    if rng.random() < MISTYPED:
        place = int(rng.integers(start, len(words)))
        if len(words[place]) > 4 and words[place].isalpha():
            words[place] = mistyped(words[place], rng)
    return LabelledGoal(tuple(words), tuple(steps), start, presence)


def mirrored_words(words: Sequence[str], start: int, rng: np.random.Generator) -> list[str]:
    """Return words with left and right exchanged, or as they were: where what is said has a left that is no side."""
    if rng.random() < MIRRORED and not _NO_SIDE.search(" ".join(words[start:])):
        return [_OTHER_SIDE.get(word, word) for word in words]
    return list(words)


def renamed_words(words: Sequence[str], rng: np.random.Generator) -> list[str]:
    """Return words with other nouns and colours, the same for the same, or as they were."""
    if rng.random() < OTHER_NOUNS:
        return _exchanged(_other_nouns(words, rng), _COLOURS, rng)
    return list(words)


def _other_nouns(words: Sequence[str], rng: np.random.Generator) -> list[str]:
    """Exchange nouns, a singular and its plural alike: what is said of a goal speaks of its nouns in both forms."""
    single = {plural(noun): noun for noun in _NOUNS}
    there = dict.fromkeys(single.get(word, word) for word in words if word in _NOUNS or word in single)
    others = dict(zip(there, rng.permutation(_NOUNS)[: len(there)].tolist(), strict=True))
    forms = others | {plural(noun): plural(other) for noun, other in others.items()}
    return [forms.get(word, word) for word in words]


def _exchanged(words: Sequence[str], pool: Sequence[str], rng: np.random.Generator) -> list[str]:
    """Exchange the words of a pool for others of it, the same word for the same."""
    there = [word for word in dict.fromkeys(words) if word in pool]
    others = dict(zip(there, rng.permutation(pool)[: len(there)].tolist(), strict=True))
    return [others.get(word, word) for word in words]


def _without_marks(
    words: list[str], steps: list[Step], presence: tuple[int, ...], start: int
) -> tuple[list[str], list[Step], tuple[int, ...]]:
    """Leave out the marks of punctuation from a place on, unless a label points at one."""
    kept = [place for place, word in enumerate(words) if place < start or word[0].isalnum()]
    places = {old: new for new, old in enumerate(kept)}
    if not kept or any(kind != KEYWORD and not set(at) <= places.keys() for kind, at in steps):
        return words, steps, presence
    moved = [(kind, at if kind == KEYWORD else tuple(places[one] for one in at)) for kind, at in steps]
    return [words[place] for place in kept], moved, tuple(presence[place] for place in kept if presence)
