"""Read where a structure faces: "facing me", "with its tip to the left"."""

from __future__ import annotations

import re
from functools import lru_cache

from grounding.corpus.templates import all_phrases
from grounding.goal_reading.tokens import Words
from grounding.structure_words import STRUCTURES

_DIR = (
    r"(?:(?:to|toward|at|on|in|into) )?(?:the |my |your |its )?(?P<dir>left|right|north|south|east|west|me|us|you|robot|arm|front|back|rear|far side|far edge|near side|near edge|"
    r"away from me|away from you|away from us|away from the robot|away from the arm|away|camera)(?: (?:side|edge|hand side|hand|end))?(?: of the (?:table|desk))?"
)
_HEADINGS = {
    **dict.fromkeys(("left", "west"), "west"), **dict.fromkeys(("right", "east"), "east"),
    **dict.fromkeys(("me", "us", "you", "robot", "arm", "front", "south", "near side", "near edge", "camera"), "south"),
    **dict.fromkeys(("back", "rear", "north", "far side", "far edge", "away"), "north"),
    **{f"away from {who}": "north" for who in ("me", "you", "us", "the robot", "the arm")},
}  # fmt: skip
_FACING = re.compile(
    r"(?:(?:so that|so|and|with|which|that|it|they|is|are|have|having|make|has|,) )*"
    r"(?:(?:(?:the|its|their|a|one) )?(?:labels?|opening|gap|open side|open bit|open end|mouth|tip|point|apex|corner|top|front|ends|entrance|open part|bulge|hollow side|vertex|hollow) )?"
    rf"(?:(?:is|are) )?(?:facing|faces|face|pointing|points|point|looking|looks|oriented|turned|opening|opens|open|aimed|directed|to|toward|on|at) {_DIR}(?! of)"
)
_FACING_WORDS = re.compile(
    r"\b(?:fac(?:ing|es?)|point(?:ing|s)?|look(?:ing|s)|oriented|turned|open(?:ing|s)?|aimed|directed|gap|tip|apex|mouth|entrance|vertex|corner|ends|bulge|hollow)\b"
)


def heading_at(said: Words, place: int) -> tuple[str, int] | None:
    """Read the longest heading that begins at a word, and the place after it; `None` where there is none."""
    found: list[tuple[str, int]] = []
    if (match := said.match(_FACING, place)) and _FACING_WORDS.search(match[0].group()):
        found.append((_HEADINGS[match[0].group("dir")], match[1]))
    for length in range(min(9, len(said.words) - place), 1, -1):
        if (heading := _rotations().get(" ".join(said.words[place : place + length]))) is not None:
            found.append((heading, place + length))
            break
    return max(found, key=lambda each: each[1], default=None)


@lru_cache(maxsize=1)
def _rotations() -> dict[str, str]:
    found: dict[str, str] = {}
    for value, phrases in all_phrases()["rot"].items():
        found |= {_spelled(phrase): value for phrase in phrases}
    for structure in STRUCTURES.values():
        own = structure.own_phrases.get("rot")
        for value, phrases in (own.phrases if own else {}).items():
            found |= {_spelled(phrase): value for phrase in phrases}
    return {phrase: value for phrase, value in found.items() if " " in phrase}


def _spelled(phrase: str) -> str:
    return " ".join(
        phrase.lower()
        .replace("-", " ")
        .replace("towards", "toward")
        .replace("centre", "center")
        .replace(",", " ,")
        .split()
    )
