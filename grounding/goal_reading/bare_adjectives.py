"""Read adjectives that stand alone for objects of a group: "stack the cans: green at the bottom, blue on top"."""

from __future__ import annotations

from collections.abc import Sequence

from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.tokens import Words
from grounding.references.attributes import COLOR_WORDS
from grounding.references.phrases import ANY, Mention

_BEFORE = ("comma", "stop", "and", "then", "followed by")
_AFTER = frozenset(
    ", . ; ! and then on in at to up goes go comes left right first last top bottom middle beside behind next between with second third".split()
) | {""}


def bare_adjective(said: Words, place: int, before: Sequence[Chunk]) -> NounPhrase | None:
    """Read a colour that stands for the one object of a group that has it; `None` where there is none.

    Args:
        said: the words.
        place: of the adjective.
        before: the chunks before it: a group must have been named, and the adjective must open a clause.
    """
    word = said.word(place)
    if word not in COLOR_WORDS or said.word(place + 1) not in _AFTER:
        return None
    if not any(one.kind == "noun phrase" and one.value.many for one in before):
        return None
    opening = before[-1].kind in _BEFORE or before[-1].said.lower() in ("with", "in the order", "in order")
    if not opening:
        return None
    span = (said.spans[place][0], said.spans[place][1])
    mention = Mention(ANY, (word,), 1, False, "target", True, False, (), None, span, True)
    return NounPhrase("objects", place, place + 1, said.quote(place, place + 1), mention, borrowed=True)
