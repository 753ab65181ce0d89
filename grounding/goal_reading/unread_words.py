"""Say which words of an instruction were not read, where the rest of it is built."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from grounding.goal_reading.goal_words import NOISE, SHAPE_NOUNS
from grounding.goals.goal import Goal
from grounding.parse_result import shortened
from grounding.references.function_words import FUNCTION_WORDS, GAPS

# Words that change no wish; gaps do ("leave a gap for the jug"), though they name no object.
_SAY_NOTHING = (NOISE | FUNCTION_WORDS | frozenset("arrangement lot whatever".split())) - GAPS
_MOST_LISTED = 4  # of a story around a wish, more would hide what was built


def unread_note(residue: Sequence[str], goal: Goal, read: Collection[str] = ()) -> str:
    """Return a remark on the words that nobody read; "" where there are none.

    Args:
        residue: words and phrases of the instruction that the grammar does not know, in the order of the text.
        goal: what was read; the nouns for its shapes were understood.
        read: further words that another reader understood, in small letters.
    """
    shapes = {part.shape for part in goal.structures}
    read = {*read, *(noun for noun, shape in SHAPE_NOUNS.items() if shape in shapes)}
    unread = []
    for words in dict.fromkeys(residue):
        said = set(re.findall(r"[^\W_]+", words.lower()))
        if said - read - _SAY_NOTHING:
            unread.append(repr(shortened(words)))
    if not unread:
        return ""
    more = f" and {len(unread) - _MOST_LISTED} more" if len(unread) > _MOST_LISTED else ""
    return f"read without knowing {', '.join(unread[:_MOST_LISTED])}{more}: say so if this changes the wish"
