"""Find numbers of a text that a goal does not hold: a number is never politeness,
so a goal without it has lost something.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache

from grounding.goals.goal import Goal
from grounding.goals.parts import Part, StructurePart
from grounding.resolve.measures import count_at, length_at
from grounding.resolve.tokens import split

_COUNTED = 0.01  # m: "back by 3" and "5 apart" are centimetres
_LISTED = frozenset((",", "and", "&", "to"))
_PRONOUNS = frozenset(("one", "zero"))  # "the green one" counts nothing


def lost_numbers(text: str, goal: Goal, phrases: Sequence[str], before: Goal = Goal()) -> tuple[str, ...]:
    """Return the numbers and lengths of a text, as they were written, that a goal does not hold.

    A goal holds a number that stands in a phrase which its objects were found by, that is one of its lengths, rows or
    columns, or that counts its parts or the objects of one of them. A number behind the noun of such a phrase is a
    name, and counts nothing: "cups 1 and 3".

    Args:
        text: what was said.
        goal: that was made of it.
        phrases: the text's words for objects.
        before: the goal so far: what is said of it may repeat its numbers.
    """
    copied = {value for phrase in phrases for _, value, _, _ in _numbers(phrase)}
    lengths, sizes, counts = (
        [*_lengths(goal), *_lengths(before)],
        {*_grid(goal), *_grid(before)},
        {*_counts(goal), *_counts(before)},
    )
    nouns = {phrase.lower().split()[-1] for phrase in phrases if phrase.split()}
    lost, named = list[str](), ""
    for said, value, is_length, follows in _numbers(text):
        named = said if follows in nouns or (named and follows in _LISTED) else ""
        held = value in copied or _is_length(value if is_length else value * _COUNTED, lengths)
        if not held and (is_length or value not in (sizes if named else sizes | counts)):
            lost.append(said)
    return tuple(lost)


@lru_cache(maxsize=256)
def _numbers(text: str) -> tuple[tuple[str, float, bool, str], ...]:
    """Return the numbers of a text: its words, the value, in metres for a length, whether it is one,
    and the word before it.
    """
    said, place, found = split(text), 0, list[tuple[str, float, bool, str]]()
    while place < len(said.words):
        length = length_at(said, place) if said.word(place) not in ("a", "an", "another") else None
        count = count_at(said, place)
        value, end = length or count or (0.0, place + 1)
        if (length or count) and not (length is None and said.word(place) in _PRONOUNS):
            found.append((said.quote(place, end), abs(float(value)), length is not None, said.word(place - 1)))
        place = end
    return tuple(found)


def _is_length(value: float, lengths: Iterable[float]) -> bool:
    return any(math.isclose(value, one, rel_tol=0.01) or math.isclose(value, 2 * one, rel_tol=0.01) for one in lengths)


def _lengths(goal: Goal) -> Iterator[float]:
    for part in goal.parts:
        keys = ("gap", "radius", "length") if isinstance(part, StructurePart) else ("distance",)
        yield from (abs(value) for key in keys if (value := getattr(part, key)) is not None)


def _grid(goal: Goal) -> Iterator[float]:
    yield from (
        float(value)
        for part in goal.parts
        for key in ("rows", "columns")
        if (value := getattr(part, key, None)) is not None
    )


def _counts(goal: Goal) -> Iterator[float]:
    """Yield what a goal counts: objects of a part, parts of a kind."""
    yield from (float(len(part.objects)) for part in goal.parts if isinstance(part.objects, tuple))
    yield from map(float, Counter(map(_kind, goal.parts)).values())


def _kind(part: Part) -> str | None:
    return part.shape if isinstance(part, StructurePart) else part.relation
