"""Positions and headings as the speaker says them, from the robot's side or from across the table, in the world's
frame.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from grounding.parse_result import Parse
from grounding.spec import SLOTS, StructureSpec

VIEWPOINTS = ("robot", "opposite")
_TURNED_SLOTS = ("x_position", "y_position", "rotation")
# "Close to you", "on your left", "away from the robot"; but not "could you put them on the left, robot".
_OF_THE_ROBOT = re.compile(
    r"\b(?:to|of|near|by|from|towards?|facing|at|beside|behind|before|against)\s+(?:the\s+)?"
    r"(?:robot(?:['’]s)?|arm(?:['’]s)?|gripper|you|yourself)\b|\byour\b|\bthe robot['’]s\b",
    re.IGNORECASE,
)
_WITHIN = 12  # characters between such words and the evidence that they belong to


class ViewpointError(ValueError):
    """A viewpoint that there is not; the message lists those that there are."""


def turned(parse: Parse) -> StructureSpec:
    """Convert the spec of a speaker on the opposite side into the world's frame."""
    across = parse.spec.turned()
    kept = {
        slot: getattr(parse.spec, slot)
        for slot in SLOTS
        if slot in _TURNED_SLOTS and _is_said_of_the_robot(parse.text, parse.evidence.get(slot, ()))
    }
    return replace(across, **kept)


def _is_said_of_the_robot(text: str, evidence: Sequence[str]) -> bool:
    spans = [match.span() for match in _OF_THE_ROBOT.finditer(text)]
    for word in evidence:
        for found in re.finditer(rf"(?<!\w){re.escape(word)}(?!\w)", text):
            for first, last in spans:
                between = text[found.end() : first] if found.end() <= first else text[last : found.start()]
                if len(between) <= _WITHIN and not set(between) & set(",.;:!?"):
                    return True
    return False
