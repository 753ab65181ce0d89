"""Read the order of a structure's objects from the place of its extreme one: "tallest at the bottom"."""

from __future__ import annotations

import re
from dataclasses import replace

from grounding.dialogue.part_lengths import CannotApplyError
from grounding.goals.parts import SHAPES_OF_KEY, Order, StructurePart

_BY = {
    "tallest": ("height", "descending"), "highest": ("height", "descending"), "shortest": ("height", "ascending"),
    "lowest": ("height", "ascending"), "biggest": ("volume", "descending"), "largest": ("volume", "descending"),
    "smallest": ("volume", "ascending"), "widest": ("width", "descending"), "narrowest": ("width", "ascending"),
}  # fmt: skip
_ENDS = {
    "left": "left", "right": "right", "front": "near", "near end": "near", "back": "far", "far end": "far",
    "bottom": "bottom", "top": "top",
}  # fmt: skip
_BEFORE = (
    r"(?:(?:and|but|with|put|have|make|no|nope|not|sorry|actually|hm+|uh|um|oh|wait|please|i|i'd|mean|meant|said|want|like"
    r"|that|it|backwards|wrong|the wrong way|rather|now|on reflection|same order)[ ,]+)*"
)
_AFTER = (
    r"(?:[ ,]+(?:please|now|then|instead|rather|sorry|same order|the same order|thanks|i (?:said|meant)"
    r"|(?:and )?not (?:at |on |in |from |to )?(?:the )?(?:left|right|front|back|near|far|top|bottom)(?: (?:end|side))?))*"
)
_EXTREME = re.compile(
    rf"{_BEFORE}(?:the )?(?P<measure>{'|'.join(_BY)})"
    r"(?: (?:one|object|thing|of (?:them|these|those)))?(?: (?:should (?:be|go)|goes|is|to be))?"
    rf" (?:at|on|in|to|towards?) (?:the |my )?(?:very |far )?(?P<end>{'|'.join(_ENDS)}|middle|center)"
    rf"(?: (?:hand )?(?:side|end))?{_AFTER}"
)
_START = re.compile(
    rf"{_BEFORE}(?:(?:in )?(?:the )?same order )?"
    r"(?:start(?:s|ing)?|begin(?:s|ning)?|go(?:es|ing)?|order(?:ed)?|count(?:ing)?|it starts)?[ ,]*(?:from|at|on|to)? ?"
    rf"(?:the |my )?(?P<end>{'|'.join(_ENDS)})(?: (?:hand )?(?:side|end))?(?P<after>{_AFTER})"
)
_SAYS_START = re.compile(r"\b(?:from|start\w*|begin\w*)\b")
_UPRIGHT = ("bottom", "top")


def extreme_at_an_end(part: StructurePart, said: str) -> StructurePart | None:
    """Return a structure ordered by a measure; `None` where a sentence says something else.

    Args:
        part: the structure.
        said: the correction in small letters.

    Raises:
        CannotApplyError: where this structure has no such end.
    """
    match = _EXTREME.fullmatch(said)
    if match is None:
        return _starting_elsewhere(part, said)
    by, direction = _BY[match["measure"]]
    start = _ENDS.get(match["end"])
    if start is None or part.shape not in SHAPES_OF_KEY["order"] or (start in _UPRIGHT) != (part.shape == "tower"):
        raise CannotApplyError(f"a {part.shape or 'structure'} cannot be asked for with {said!r}")
    return replace(part, order=Order(by, direction, start))


def _starting_elsewhere(part: StructurePart, said: str) -> StructurePart | None:
    """Return an ordered structure that begins at another end: "same order, but from the right"."""
    match = _START.fullmatch(said)
    if match is None or part.order is None or not _SAYS_START.search(said):
        return None
    start = _ENDS[match["end"]]
    if (start in _UPRIGHT) != (part.shape == "tower"):
        raise CannotApplyError(f"a {part.shape} cannot be asked for with {said!r}")
    return replace(part, order=replace(part.order, start=start))
