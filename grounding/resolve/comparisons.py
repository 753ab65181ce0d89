"""Read with what the objects of a phrase are compared: "taller than the can"."""

from __future__ import annotations

from grounding.resolve.adjectives import size_of
from grounding.resolve.measures import lengths_of
from grounding.resolve.phrase import Draft, Rank, Test
from grounding.resolve.phrase_text import PhraseReader
from grounding.resolve.tokens import split

_OTHERS = ("the others", "the other ones", "all others", "all the others", "its neighbours")


def comparison_at(parser: PhraseReader, at: int) -> tuple[Test | Rank, int] | None:
    """Read "taller than the can" or "below fifteen centimetres".

    Returns:
        What it asks of the objects and the place after it, or `None` where none stands.
    """
    word = parser.word(at)
    size = size_of(word)
    more = size is not None and size[1] == "more" and parser.word(at + 1) == "than"
    if not more and word not in ("below", "under", "over", "above"):
        return None
    place = at + 1 + (parser.word(at + 1) == "than")
    adjective = size[0] if size is not None else "short" if word in ("below", "under") else "tall"
    length = lengths_of(split(" ".join(parser.words[place:]))).get(0)
    if length is not None:
        return Test("measure", adjective, value=abs(length[0])), place + length[1]
    other = parser.at(place) if size is not None else None
    if other is None:
        return None
    if other[0].kind in ("rest", "all") or other[0].text in _OTHERS:
        return Rank(adjective), other[1]  # "larger than its siblings"
    return Test("more", adjective, other=other[0]), other[1]


def comparison_after(parser: PhraseReader, draft: Draft, at: int) -> int | None:
    """Read a comparison of sizes into a draft; return the place after it, or `None` where none stands."""
    found = comparison_at(parser, at)
    if found is None:
        return None
    if isinstance(found[0], Rank):
        draft.rank = found[0]
    else:
        draft.test(found[0])
    return found[1]
