"""Read that objects are alike or the only ones of their sort: "without a twin", "of the same size"."""

from __future__ import annotations

import re

from grounding.goal_reading.phrase_references.draft import Draft
from grounding.goal_reading.phrase_references.phrase import Test
from grounding.goal_reading.phrase_references.phrase_text import PhraseReader

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
