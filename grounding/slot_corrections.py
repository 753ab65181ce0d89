"""Correct slots for plain words that parsers miss: "centre left", "not so small", "a row going away from me".

Each rule is for words that have one meaning wherever they stand, and changes the one slot that they speak of.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

from grounding.parse_result import Parse
from grounding.references.pattern_parts import any_of
from grounding.structure_words import STRUCTURES

_TABLETOP = re.compile(r"\b(?:table|desk|bench|counter) top\b")
_BACK = re.compile(r"\b(?:back|rear|far|away)\b")
# Words of rotations, for the shapes that have them.
_ROTATIONS = {
    shape: re.compile(rf"\b{any_of(structure.rotations)}\b")
    for shape, structure in STRUCTURES.items()
    if structure.rotations
}
_BESIDE_CENTER = re.compile(
    r"\b(?:cent(?:er|re)|mid(?:dle)?) (?P<after>left|right)\b(?! (?:to|and|or)\b)"
    r"|(?<!to the )\b(?P<before>left|right) cent(?:er|re)\b(?! (?:of|to)\b)"
)
_TAG = re.compile(r", right \?")
_RIGHT = re.compile(r"\b(?:\w*right\w*|east\w*)\b")
_REMAINING = re.compile(
    r"\b(?:only|just|still|\d+|two|three|four|five|six|few|some|none|nothing|what|all|that|which)(?: \w+){0,2} (?:is|are|was|were) left\b"
    r"|\bleft over\b"
)
_SIZES = {
    "small": "small|tiny|tight|compact|narrow|short|cramped|dense|little|close together|tightly packed",
    "large": "large|big|huge|wide|long|spread out|loose|spacious|roomy|far apart",
}
_SIZE = {size: re.compile(rf"\b(?:{words})\b") for size, words in _SIZES.items()}
_DEGREE = r"(?:(?:too|so|very|that|all that|overly|particularly|terribly|quite|really|such) )*"
# "Not so small", "don't make it too wide": an end of the scale is excluded, and the middle of it is right.
_DENIED_SIZE = {
    size: re.compile(
        rf"\b(?:not|anything but|(?:don't|do not|never|shouldn't|should not|mustn't|must not|can't|cannot)"
        rf" (?:be|make|build|get|let|leave|keep|have|want)(?: (?:it|them|that|this|the \w+))?(?: be| get)?)"
        rf" (?:an? )?{_DEGREE}(?:an? )?(?:{words})\b"
    )
    for size, words in _SIZES.items()
}
_DOWN = r"(?:the|this|my) (?:table|desk)"
_FACES = r"\b(?:fac|look|point|open|head)\w*(?: straight| directly)?"
_UP_THE_TABLE = (
    (re.compile(rf"{_FACES} up {_DOWN}\b"), "north"),
    (re.compile(rf"{_FACES} down {_DOWN}\b"), "south"),
)
_AWAY = (
    r"(?:(?:straight |directly )?away from (?:me|us|you|the robot|the arm)|from (?:the )?(?:front|near\w*)(?: \w+)? to (?:the )?(?:back|rear|far)"
    r"|from (?:the )?(?:back|rear|far)(?: \w+)? to (?:the )?(?:front|near))"
)
# Such a line runs in depth, and so it faces to the side.
_INTO_DEPTH = re.compile(
    rf"\b(?:line|row|queue|file|column|chain)\b(?: of (?:\w+ )?\w+)?,?(?: (?:that|which))?"
    rf" (?:go|run|lead|stretch|extend)(?:s|es|ing)? {_AWAY}\b"
    r"|\b(?:beginning|starting) (?:at|from) the (?:near|front)(?: \w+)?,?(?: and)? ending at the (?:far|back)\b"
)
_SEAT = re.compile(
    r"\b(?:(?:as )?(?:seen|viewed|looking) )?from (?:my|our|your) (?:seat|chair|place|perspective|point of view|viewpoint|angle|position|spot)\b"
    r"|\bfrom where (?:i|we|you) (?:sit|stand|am|are)(?: \w+ing)?\b"
)
_NEAR = re.compile(
    r"\b(?:front|near\w*|clos\w*|bottom|by|beside|before|south\w*|lower|reach\w*|next to|at my|on my side|this side)\b"
)
_AT_ARM = re.compile(
    r"\b(?:on|at|to) the (?:side|end|part|half) (?:of the (?:robot|arm)\b|(?:that |where )?(?:the (?:robot|arm)|you)"
    r" (?:is|are|stands?|sits?)\b)"
)


def with_plain_words(sentence: str, parse: Parse) -> Parse:
    """Return the parse with corrections for plain words that parsers miss.

    Args:
        sentence: the instruction in small letters, with one space between words and marks, and without hyphens.
        parse: the parser's result, which is not refused.
    """
    for rule in _RULES:
        parse = rule(sentence, parse)
    return parse


def _tabletop(sentence: str, parse: Parse) -> Parse:
    """Read no depth in "on the table top"."""
    spec = parse.spec
    alone = spec.y_position == "top" and len(re.findall(r"\btop\b", sentence)) == 1
    if alone and _TABLETOP.search(sentence) and not _BACK.search(sentence):
        return replace(parse, spec=replace(spec, y_position=None))
    return parse


def _direction(sentence: str, parse: Parse) -> Parse:
    """Read the direction of a line: "a vertical line", "a row going away from me"; and "facing up the table"."""
    spec = parse.spec
    for pattern, heading in _UP_THE_TABLE:
        if match := pattern.search(sentence):
            return _filled(parse, "rotation", heading, match.group())
    rotations = _ROTATIONS.get(spec.shape or "")
    if rotations is None:
        return parse
    if spec.rotation is None and (match := rotations.search(sentence)):
        return _filled(parse, "rotation", STRUCTURES[spec.shape or ""].rotations[match.group()], match.group())
    if spec.rotation in (None, "north", "south") and (match := _INTO_DEPTH.search(sentence)):
        return _filled(parse, "rotation", STRUCTURES[spec.shape or ""].rotations["vertical"], match.group())
    return parse


def _beside_center(sentence: str, parse: Parse) -> Parse:
    """Read "centre left" as the left side, at half depth."""
    match = _BESIDE_CENTER.search(sentence)
    if match is None or parse.spec.x_position not in (None, "center"):
        return parse
    parse = _filled(parse, "x_position", match.group("after") or match.group("before"), match.group())
    return parse if parse.spec.y_position else _filled(parse, "y_position", "middle", match.group())


def _remaining(sentence: str, parse: Parse) -> Parse:
    """Read no place in "only four are left"."""
    remaining = len(_REMAINING.findall(sentence))
    if parse.spec.x_position != "left" or not remaining or len(re.findall(r"\b(?:left\w*|west\w*)\b", sentence)) > remaining:
        return parse
    return replace(parse, spec=replace(parse.spec, x_position=None))


def _tag(sentence: str, parse: Parse) -> Parse:
    """Read no place in the tag "..., right?"."""
    tags = len(_TAG.findall(sentence))
    if parse.spec.x_position != "right" or not tags or len(_RIGHT.findall(sentence)) > tags:
        return parse
    return replace(parse, spec=replace(parse.spec, x_position=None))


def _denied_size(sentence: str, parse: Parse) -> Parse:
    """Read "not so small" as medium, if no other size is said."""
    size = parse.spec.size
    pattern = _DENIED_SIZE.get(size or "")
    match = pattern.search(sentence) if pattern else None
    if match is None or sum(len(each.findall(sentence)) for each in _SIZE.values()) != 1:
        return parse
    return _filled(parse, "size", "medium", match.group())


def _depth(sentence: str, parse: Parse) -> Parse:
    """Read a depth in "on the side of the arm", and none in "from my seat, on the right"."""
    depth = parse.spec.y_position
    if depth is None and (match := _AT_ARM.search(sentence)):
        return _filled(parse, "y_position", "bottom", match.group())
    if depth == "bottom" and _SEAT.search(sentence) and not _NEAR.search(_SEAT.sub("", sentence)):
        return replace(parse, spec=replace(parse.spec, y_position=None))
    return parse


def _filled(parse: Parse, slot: str, value: str, words: str) -> Parse:
    """Return the parse with the value that these words say for certain."""
    if getattr(parse.spec, slot) == value:
        return parse
    if parse.question is not None and parse.question.slot == slot:
        parse = replace(parse, status="ok", message="", question=None)
    return replace(
        parse, spec=replace(parse.spec, **{slot: value}), confidence={**parse.confidence, slot: 1.0},
        evidence={**parse.evidence, slot: (words,)},
    )  # fmt: skip


_RULES: tuple[Callable[[str, Parse], Parse], ...] = (
    _tabletop, _direction, _beside_center, _remaining, _tag, _denied_size, _depth,
)  # fmt: skip
