"""Find arrangements that a text takes objects of and that nobody knows: "a tower of the back row of blocks".

The network copies "blocks", and would take "back" for the tower's place.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import cache

from grounding.goals.goal import Goal
from grounding.structure_words import STRUCTURES, words_of_all

_HEAPS = frozenset(("tower", "pyramid", "cluster"))  # "the heap of toys" may be any of these


def unknown_group(text: str, phrases: Iterable[str], goals: Sequence[Goal]) -> str:
    """Return the words of a text that name an arrangement of what a phrase means, "the back row of blocks", where no
    goal has a structure of that shape; "" where there are none.

    Args:
        text: what was said.
        phrases: the text's words for objects.
        goals: that was made of it, and the goal so far.
    """
    if _opening().search(text) is None:
        return ""
    shapes = {part.shape for goal in goals for part in goal.structures}
    known = shapes | (_HEAPS if shapes & _HEAPS else frozenset())
    for phrase in phrases:
        said = rf"{_opening().pattern}(?:the |these |those |my |your )?{re.escape(phrase)}\b"
        for found in re.finditer(said, text, re.IGNORECASE):
            if not _shapes_of(found[1].lower()) & known:
                return found[0]
    return ""


@cache
def _opening() -> re.Pattern[str]:
    """Return the pattern of words that take objects of an arrangement, "the back row of ", with its noun: one that
    means an arrangement and never an object. There are so many of these that it takes milliseconds to compile.
    """
    nouns = "|".join(sorted(map(re.escape, words_of_all("never_objects")), key=len, reverse=True))
    return re.compile(rf"\b(?:the|that|this) (?:[\w-]+ )?({nouns}) of ", re.IGNORECASE)


def _shapes_of(noun: str) -> set[str]:
    return {
        name for name, shape in STRUCTURES.items() if noun in shape.words.never_objects or noun in shape.words.nouns
    }
