"""Read with what the objects of a copied phrase are compared: "taller than the can", "of the same colour"."""

from __future__ import annotations

import re
from dataclasses import replace

from grounding.goal_reading.measures import lengths_of
from grounding.goal_reading.phrase_references.adjectives import COLOUR_OF, size_of
from grounding.goal_reading.phrase_references.draft import Draft
from grounding.goal_reading.phrase_references.phrase import Rank, Test
from grounding.goal_reading.phrase_references.phrase_text import PhraseReader
from grounding.goal_reading.tokens import split

_SAME = re.compile(
    r"(?:(?:that |which )?(?:of|in|with|having|has|have|is of|is in|are of|are in|is|are)) (?:the |its |a )?"
    r"(?:same|like|matching|that|equal|identical) colour(?P<as>(?: as| of| like)(?= ))?"
    r"|(?:that |which |whose colour )?(?:match|matches|matching)(?P<to>(?= ))"
)
_OTHERS = ("the others", "the other ones", "all others", "all the others", "its neighbours")
_HUE = re.compile(
    r"(?:that (?:is|are) )?(?:in |with |of |is |are )?(?:coloured like|the colours? of|colours? of|"
    r"(?:the )?same colours? as|as \w+ as|like)(?: the| a| an)? (?P<what>stop sign|fire engine|\w+)"
)


def likeness_after(parser: PhraseReader, draft: Draft, at: int) -> int | None:
    """Read "of the same colour as the can", "the colour of wine" or "coloured like grass" into a draft.

    Returns:
        The place after it, or `None` where none stands.
    """
    said = " ".join(parser.words[at:])
    hue = _HUE.match(said)
    if hue is not None and (colour := COLOUR_OF.get(hue.group("what"))) is not None:
        draft.test(Test("colour", colour))
        return at + len(hue.group().split())
    same = _SAME.match(said)
    if same is None:
        return None
    end = at + len(same.group().split())
    if same.group("as") is None and same.group("to") is None:
        draft.test(Test("alike", "colour"))
        return end
    end += 2 * (parser.words[end : end + 2] == ("that", "of"))
    other = parser.at(end)
    if other is None:
        return None
    model = other[0] if other[0].definite else replace(other[0], plural=True)
    draft.test(Test("alike", "colour", other=model))
    return other[1] + 2 * (parser.words[other[1] : other[1] + 2] in (("in", "colour"), ("by", "colour")))


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
    if other[0].kind in ("rest", "all", "twin") or other[0].text in _OTHERS:
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
