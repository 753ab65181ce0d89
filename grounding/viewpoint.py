"""Hear what is said from the opposite side of the table: what is relative to the robot stays the robot's.

A goal is read in the speaker's frame and turned as a whole. Words that relate a place to the robot ("on your left",
"close to the robot") are therefore first put as the speaker would say them of the own side. Other words for the robot
stay: "could you, robot".
"""

from __future__ import annotations

import re
from functools import partial

from grounding.spec import OPPOSITE

VIEWPOINTS = ("robot", "opposite")
_MACHINE = r"(?:robot(?:ic)? arm|robot|arm|gripper|manipulator|base)"
_ROBOT = rf"(?:you(?:rself)?|(?:the|your)(?: own)? {_MACHINE})(?![\w'’])"
_ROBOTS = rf"(?:your|(?:the )?{_MACHINE}['’]s)(?: own)?"
_FACING = (
    r"(?:fac(?:e|es|ed|ing)|point(?:s|ed|ing)?|look(?:s|ing)?|turn(?:ed|ing)?|open(?:s|ing)?)"
    r"(?: (?:directly|straight))?"
)
_JUST = r"(?:(?<!the )(?<!your )(?<!my )(?<!['’]s )right |directly |just |straight )?"
# A word for a place -> what the speaker across the table says of the same place.
_OTHER = {
    **OPPOSITE, "close": "far", "closer": "farther", "closest": "farthest", "nearer": "farther", "nearest": "farthest",
    "next": "far", "away": "close", "far": "close", "farther": "closer", "further": "closer", "farthest": "closest",
    "furthest": "closest",
}  # fmt: skip
_LENGTH = r"\d\s*(?:mm|cm|m|centimet(?:er|re)s?|met(?:er|re)s?|inch(?:es)?|bit|little)"
# How a place or a heading is related to the robot -> the same of the speaker's own side; {1} is the first group,
# "{other}" its opposite. An earlier one is put first: what it writes says nothing of the robot any more.
_WAYS = tuple((re.compile(pattern, re.IGNORECASE), own) for pattern, own in (
    (rf"\b({_FACING}) away from {_ROBOT}", "{1} toward me"),
    (rf"\b(fac(?:e|es|ed|ing)(?: directly| straight)?) {_ROBOT}|\b({_FACING}) (?:at|to|towards?) {_ROBOT}",
     "{1} away from me"),
    (rf"\b(left|right)((?: \w+){{0,3}}?),? (?:as )?(?:seen )?(?:from|in) "
     rf"(?:{_ROBOTS} (?:side|perspective|point of view|view\w*)|{_ROBOT})",
     "{other}{2}"),
    (rf"\b{_ROBOTS} (side|end|edge|half)\b", "the far {1}"),
    (rf"\b{_JUST}in front of {_ROBOT}", "far from me"),
    (rf"\b(?:across from|opposite(?: to| from)?) {_ROBOT}", "close to me"),
    (rf"({_LENGTH}) away from {_ROBOT}", "{1} towards me"),
    (rf"\b(towards?) {_ROBOT}", "away from me"),
    (rf"\b(away|far|farther|further|farthest|furthest)((?: (?:side|end|edge))?) from {_ROBOT}", "{other}{2} to me"),
    (rf"\b(close|closer|closest|near|nearer|nearest|next)(?: to)? {_ROBOT}", "{other} from me"),
    (rf"\b{_ROBOTS} (left|right)\b", "the {other}"),
    (rf"\b(?:the )?(left|right)((?:[- ]hand)?(?: side)?) of {_ROBOT}", "the {other}{2}"),
))  # fmt: skip


class ViewpointError(ValueError):
    """A viewpoint that there is not; the message lists those that there are."""


def spoken_across(text: str) -> str:
    """Return what a speaker on the opposite side says, with places relative to the robot as relative to the speaker."""
    for pattern, own in _WAYS:
        text = pattern.sub(partial(_put, own=own), text)
    return text


def _put(found: re.Match[str], own: str) -> str:
    groups = [each or "" for each in found.groups()]
    first = next(filter(None, groups), "")
    second = groups[1] if len(groups) > 1 else ""
    return own.replace("{1}", first).replace("{2}", second).replace("{other}", _OTHER.get(first.lower(), first))
