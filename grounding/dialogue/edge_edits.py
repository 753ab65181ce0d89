"""Move a line to another edge of the table: "the left edge, I meant", "not the edge near me"."""

from __future__ import annotations

import re
from dataclasses import replace

from grounding.dialogue.goal_mentions import GoalText
from grounding.dialogue.relation_edits import FILLERS
from grounding.goals.parts import StructurePart

_SIDES = {
    "left": "left", "right": "right", "near": "near", "front": "near", "nearest": "near", "close": "near",
    "closest": "near", "nearer": "near", "bottom": "near", "far": "far", "back": "far", "farthest": "far",
    "furthest": "far", "top": "far", "rear": "far", "opposite": "opposite", "other": "opposite",
}  # fmt: skip
_ACROSS = {"left": "right", "right": "left", "near": "far", "far": "near"}
_SIDE = "|".join(_SIDES)
_EDGE = re.compile(
    rf"\b(?:along |at |on |to |by |for |onto )?(?:the |my |that )?(?P<side>{_SIDE})(?: hand)?(?: side)?"
    r" (?:edge|rim|border)(?: of the table)?\b"
    r"|\b(?:the )?(?:edge|rim|border) (?:(?P<near>near(?:est)?(?: to)? me|closest to me)"
    r"|(?P<away>away from me|(?:far|furthest|farthest) from me))"
)
_ONE = re.compile(rf"\b(?:along )?the (?P<side>{_SIDE}) one\b")
_NOT = re.compile(
    rf"\b(?:and )?not (?:along |at |on )?(?:the )?(?:(?:{_SIDE})(?: (?:edge|rim|side|one|end))?"
    r"|(?:edge|rim) (?:near|away from) me)\b"
)
_FILLERS = FILLERS | frozenset("along edge rim mate row line".split())


def along_another_edge(part: StructurePart, text: GoalText, spans: list[tuple[int, int]]) -> StructurePart | None:
    """Return a line that goes along another edge; `None` where the sentence says something else.

    Args:
        part: the structure.
        text: the correction.
        spans: of the words for the structure and its objects.
    """
    if part.along is None:
        return None
    denied = [match.span() for match in _NOT.finditer(text.said)]
    found = [
        match
        for pattern in ((_EDGE, _ONE) if denied else (_EDGE,))
        for match in pattern.finditer(text.said)
        if not any(first <= match.start() < end for first, end in denied)
    ]
    if len(found) != 1 or text.left_over([*spans, *denied, found[0].span()], _FILLERS):
        return None
    words = found[0].groupdict()
    side = "near" if words.get("near") else "far" if words.get("away") else _SIDES[words["side"]]
    along = _ACROSS[part.along] if side == "opposite" else side
    across = along in ("left", "right")
    return replace(part, along=along, **({"x_position": None} if across else {"y_position": None}))
