"""Apply a relative clause to the objects of its noun: "the cups that are red", "everything that isn't blue"."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from grounding.references.attributes import TELLING_ADJECTIVES
from grounding.references.phrases import Mention
from grounding.references.sentence_roles import Sentences


def says_more(mention: Mention) -> bool:
    """Tell whether a phrase without a noun says more than "everything"."""
    return bool(mention.numbers or mention.modifiers or mention.ordinal or mention.exact)


def with_clause(
    said: Sentences, spans: Sequence[tuple[int, int]], mention: Mention, end: int
) -> tuple[Mention, list[Mention], int]:
    """Apply the clause after a mention, as in "the cups that are red" or "the cups which aren't red".

    Args:
        said: the words.
        spans: (first, end) characters of each word.
        mention: a noun phrase.
        end: the place after it.

    Returns:
        The mention, the mention of the objects that the clause excludes, and the position after the clause.
    """
    if "non" in mention.modifiers[:-1]:  # "the non-red cups"
        at = mention.modifiers.index("non")
        kept = mention.modifiers[:at] + mention.modifiers[at + 2 :]
        denied = mention.modifiers[at + 1 : at + 2]
        left_out = replace(mention, modifiers=denied, role="left out", count=None, exact=False)
        return replace(mention, modifiers=kept), [left_out], end
    contracted = said.word(end) == "that's"
    if said.word(end) not in ("that", "which") and not contracted:
        return mention, [], end
    end -= contracted
    verb = "is" if contracted else said.word(end + 1)
    without_them = verb in ("isn't", "aren't") or said.word(end + 2) == "not"
    place = end + 2 + (without_them and said.word(end + 2) == "not")
    if verb not in ("is", "are", "isn't", "aren't") or said.word(place) not in TELLING_ADJECTIVES:
        return mention, [], end + contracted
    words = [said.word(place)]
    while said.word(place + 1) in ("and", "or", "nor") and said.word(place + 2) in TELLING_ADJECTIVES:
        words.append(said.word(place + 2))
        place += 2
    span = (mention.span[0], spans[place][1])
    if without_them:
        without = [replace(mention, modifiers=(word,), role="left out", count=None, exact=False) for word in words]
        return replace(mention, span=span), without, place + 1
    described = [replace(mention, modifiers=(*mention.modifiers, word), span=span) for word in words]
    return described[-1], described[:-1], place + 1
