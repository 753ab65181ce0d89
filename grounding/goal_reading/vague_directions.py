"""Find directions that no relation holds: between two sides of an object, and away from one."""

from __future__ import annotations

import re
from collections.abc import Sequence

from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.places import Place
from grounding.goals.parts import DIRECTIONAL
from grounding.parse_result import shortened

_SIDEWAYS = ("left of", "right of")
_WITH_ITS_OWN_PREPOSITION = re.compile(r"\b(?:to|on|at|in|toward) ", re.IGNORECASE)
_FAR = re.compile(r"(?:far|farther|further)(?: away)?(?: from)?", re.IGNORECASE)
_OF_AN_OBJECT = ("objects", "pronoun", "structure", "part")


def vague_direction(text: str, chunks: Sequence[Chunk]) -> str:
    """Return why the direction that an instruction gives is none that a relation holds; "" where all are.

    Args:
        text: the instruction.
        chunks: of it, without corrections.
    """
    for at in range(len(chunks)):
        if (found := _between_two(chunks, at)) is not None:
            words, one, other = found
            return (
                f"{words!r} in {shortened(text)!r} lies between two directions, and a relation holds one: "
                f"say “{one}” or “{other}”"
            )
        if words := _away(chunks, at):
            return f"{words!r} in {shortened(text)!r} does not say how far, or where on the table"
    return ""


def _between_two(chunks: Sequence[Chunk], at: int) -> tuple[str, str, str] | None:
    """Find "at the top right of the plate", "left behind the plate", "behind and to the right of the plate"."""
    one = chunks[at]
    if not any(_names_an_object(each) for each in chunks[at + 1 : at + 5]):
        return None  # "at the top left of the mat" is a place on the table
    rest = [each for each in chunks[at + 1 : at + 3] if each.kind != "noise"]
    if one.kind == "relation" and one.value in DIRECTIONAL and [each.kind for each in rest] == ["and", "relation"]:
        other = rest[1]
        if other.value in DIRECTIONAL and _across(one.value, other.value):
            return f"{one.said} and {other.said}", one.value, other.value
    if not rest or rest[0].kind != "relation" or rest[0].value not in DIRECTIONAL:
        return None
    other, side = rest[0], _direction_of(one)
    if side is None or not _across(side, other.value):
        return None
    # "At the back to the left of the plate" gives a place on the table and a side of the plate.
    sideways = other.value in _SIDEWAYS
    apart = _WITH_ITS_OWN_PREPOSITION.search(other.said if sideways else one.said)
    return None if apart else (f"{one.said} {other.said}", side, other.value)


def _names_an_object(chunk: Chunk) -> bool:
    """Return whether a chunk names an object, a structure or what was named before: no part of the table."""
    if chunk.kind != "noun phrase" or chunk.value.kind not in _OF_AN_OBJECT:
        return False
    said = chunk.value.mention
    return said is None or said.known


def _named_before(chunks: Sequence[Chunk]) -> int:
    """Count the phrases for objects: with one alone, "far from it" is said of what is not on the table."""
    return sum(chunk.kind == "noun phrase" and chunk.value.kind == "objects" for chunk in chunks)


def _across(one: str, other: str) -> bool:
    return (one in _SIDEWAYS) != (other in _SIDEWAYS)


def _direction_of(chunk: Chunk) -> str | None:
    """Return the direction that a place on one side of the table has, or "on the top", which comes before "right of"."""
    if chunk.kind == "relation it" and chunk.said.lower().endswith("top"):
        return "behind"
    if chunk.kind != "place":
        return None
    place: Place = chunk.value
    if place.y_position is None:
        return {"left": "left of", "right": "right of"}.get(place.x_position or "")
    return {"top": "behind", "bottom": "in front of"}.get(place.y_position) if place.x_position is None else None


def _away(chunks: Sequence[Chunk], at: int) -> str:
    """Find "far away from it"."""
    if chunks[at].kind != "place":
        return ""
    for end in range(at + 1, min(at + 4, len(chunks))):
        words = " ".join(each.said for each in chunks[at:end])
        if _FAR.fullmatch(words) is None:
            return ""
        if words.lower().endswith("from"):
            named = _names_an_object(chunks[end]) and (chunks[end].value.kind != "pronoun" or _named_before(chunks[:at]) > 1)
            return f"{words} {chunks[end].said}" if named else ""
    return ""
