"""Read where the objects of a phrase stand: "to the left of the plate", "between the mugs", "nearest to me",
"at the back".
"""

from __future__ import annotations

import re

from grounding.resolve.phrase import Draft, Phrase, Test
from grounding.resolve.phrase_text import PhraseReader
from grounding.resolve.place_words import sides_at

_STANDING = (
    r"(?:(?:that|which) )?(?:(?:is|are|stands?|standing|sits?|sitting|lies?|lying|rests?|resting|placed|located|"
    r"positioned|just|right|directly|immediately|straight|over|here|there) )*"
)
_HERE = r"(?:(?:to|on|at|in|from) )?(?:(?:the|your|my|its) )?"
# What can be said of a side of the table as well: "the left of the plate", "the left of the table".
_DIRECTIONS = {
    "left of": rf"{_HERE}left (?:side )?of",
    "right of": rf"{_HERE}right (?:side )?of",
    "in front of": rf"{_HERE}front (?:side )?of|before|ahead of",
    "behind": rf"{_HERE}(?:back|rear) (?:side )?of|behind|beyond",
}
_RELATIONS = {
    "next to": "next to|beside|close to|near to|near|by|flanking|alongside|adjacent to",
    "between": "in between|between",
    "on": "on top of|on",
    "in": "inside of|inside|within|in",
}
_NEAREST = re.compile(
    rf"{_STANDING}(?:the )?(?P<how>closest|nearest|nearer|closer|furthest|further)(?: away)?(?: (?:to|from))?(?= )"
)


def _patterns(words: dict[str, str]) -> dict[str, re.Pattern[str]]:
    return {relation: re.compile(rf"{_STANDING}(?:{each})(?= )") for relation, each in words.items()}


_OF_DIRECTION, _OF_RELATION = _patterns(_DIRECTIONS), _patterns(_RELATIONS)


def standing_at(parser: PhraseReader, at: int, noun: tuple[str, ...] = ()) -> tuple[Test, int] | None:
    """Read where objects stand: in a direction from others, on a side of the table, nearest to something, on or by it.

    Args:
        parser: of the phrase.
        at: the place of the first word.
        noun: of the phrase, which "the left of the two" is said of as well.

    Returns:
        What it asks of the objects and the place after it, or `None` where none stands.
    """
    said = " ".join(parser.words[at:])
    if (found := _related(parser, at, said, _OF_DIRECTION, noun)) is not None:
        return found
    if (sides := sides_at(parser.words, at)) is not None:
        return Test("place", sides=sides[0]), sides[1]
    nearest = _NEAREST.match(said)
    other = parser.at(at + len(nearest.group().split())) if nearest is not None else None
    if nearest is not None and other is not None:
        return Test("nearest", "far" if nearest["how"].startswith("fur") else "near", other=other[0]), other[1]
    return _related(parser, at, said, _OF_RELATION, ())


def standing_after(parser: PhraseReader, draft: Draft, at: int) -> int | None:
    """Read where objects stand into a draft; return the place after it, or `None` where none stands."""
    found = standing_at(parser, at, draft.noun)
    if found is None:
        return None
    draft.test(found[0])
    return found[1]


def _related(
    parser: PhraseReader, at: int, said: str, patterns: dict[str, re.Pattern[str]], noun: tuple[str, ...]
) -> tuple[Test, int] | None:
    for relation, pattern in patterns.items():
        found = pattern.match(said)
        first = parser.at(at + len(found.group().split())) if found is not None else None
        if first is None or (found is not None and found.group().endswith(" of") and _group(first[0], noun)):
            continue
        joined = relation == "between" and parser.word(first[1]) == "and"
        second = parser.at(first[1] + 1) if joined else None
        if second is not None:
            return Test("stands", relation, other=first[0], second=second[0]), second[1]
        return Test("stands", relation, other=first[0]), first[1]
    return None


def _group(landmark: Phrase, noun: tuple[str, ...]) -> bool:
    """Tell whether "the left of the two", "the left of the mugs", "left of the middle" are said of a side."""
    nothing = landmark.bare and all(each[0].kind == "place" for each in landmark.tests)
    return nothing or (bool(landmark.plural) and landmark.noun == noun)
