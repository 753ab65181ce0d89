"""Read with what the objects of a phrase are compared: "taller than the can", "of the same colour",
"without a twin".
"""

from __future__ import annotations

import re
from dataclasses import replace

from grounding.resolve.adjectives import COLOUR_OF, size_of
from grounding.resolve.measures import lengths_of
from grounding.resolve.phrase import Draft, Rank, Test
from grounding.resolve.phrase_text import PhraseReader
from grounding.resolve.tokens import split

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


_TWIN = r"(?:twin|partner|match|counterpart|pair|double|mate|sibling|duplicate|equal|companion)s?"
_HAVING = r"(?:(?:that |which |who )?(?:has|have)|with|having)"
_IN_COLOUR = r"(?: (?:in|of|by) colour)?"
_LONELY = re.compile(
    rf"(?:{_HAVING} (?:no|not a|not any)|(?:that |which )?(?:does|do) not have (?:a|any|its)|without (?:a|any|its)) "
    rf"{_TWIN}{_IN_COLOUR}(?= |$)"
)
_OWN_COLOUR = re.compile(
    rf"(?:{_HAVING}|of|in) (?:a |the |its )?(?:unique|own|only|single|odd) colour(?= |$)"
    r"|(?:that is |which is )?unique(?: in colour)?(?= |$)|(?:that )?there is only one of(?= |$)"
)
_ALONE = re.compile(r"of (?:its|their|that) (?:own )?(?P<what>colour|kind|sort|type)(?= |$)")
_PAIRED = re.compile(
    rf"{_HAVING} (?:a |an |its |their |their own |one )?{_TWIN}{_IN_COLOUR}(?= |$)"
    r"|(?:that come |coming |that are )?in pairs(?= |$)"
)
_EQUAL = re.compile(
    rf"(?:(?:that |which )?(?:is |are )?(?:of|in)|{_HAVING}|(?:that |which )?share|sharing) (?:the |an |a )?"
    r"(?:same|equal|identical|like) (?P<what>size|height|width|length|colour|kind|shape)(?! as| of)(?= |$)"
    r"|(?:that |which )?(?:are|look) (?:identical|the same|alike|equal)(?= |$)"
)
_OF_KIND = ("kind", "sort", "type", "shape")


def uniqueness_after(parser: PhraseReader, draft: Draft, at: int) -> int | None:
    """Read into a draft that its objects are alike, or have nothing like them.

    Returns:
        The place after it, or `None` where none stands.
    """
    said = " ".join(parser.words[at:])
    found = _read(said, draft)
    if found is None:
        return None
    draft.test(found[0])
    return at + len(found[1].split())


def _read(said: str, draft: Draft) -> tuple[Test, str] | None:
    if found := _LONELY.match(said):
        return Test("lonely", "colour" if found.group().endswith("colour") else ""), found.group()
    if found := _OWN_COLOUR.match(said):
        return Test("lonely", "" if found.group().endswith("of") else "colour"), found.group()
    if draft.count == 1 and (found := _ALONE.match(said)):  # "the only one of its colour"
        return Test("lonely", "kind" if found.group("what") in _OF_KIND else "colour"), found.group()
    if found := _PAIRED.match(said):
        draft.plural = True if draft.count is None else draft.plural
        return Test("lonely", "colour" if found.group().endswith("colour") else "", negated=True), found.group()
    several = draft.count not in (None, 1) or draft.every or draft.plural
    if several and (found := _EQUAL.match(said)):
        what = found.group("what") or ""
        return Test("equal", "kind" if what in _OF_KIND else what), found.group()
    return None
