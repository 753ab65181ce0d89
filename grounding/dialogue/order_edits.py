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
_EXTREME = re.compile(
    rf"(?:(?:and|but|with|put|have|make) )?(?:the )?(?P<measure>{'|'.join(_BY)})"
    r"(?: (?:one|object|thing|of (?:them|these|those)))?(?: (?:should (?:be|go)|goes|is|to be))?"
    rf" (?:at|on|in|to|towards?) (?:the |my )?(?:very |far )?(?P<end>{'|'.join(_ENDS)}|middle|center)"
    r"(?: (?:hand )?(?:side|end))?(?: (?:please|now|then))?"
)
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
        return None
    by, direction = _BY[match["measure"]]
    start = _ENDS.get(match["end"])
    if start is None or part.shape not in SHAPES_OF_KEY["order"] or (start in _UPRIGHT) != (part.shape == "tower"):
        raise CannotApplyError(f"a {part.shape or 'structure'} cannot be asked for with {said!r}")
    return replace(part, order=Order(by, direction, start))
