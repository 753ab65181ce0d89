"""Recognise nouns of objects that neither the tables nor the scene know, by their place in the sentence."""

from __future__ import annotations

import re

from grounding.references.attributes import TELLING_ADJECTIVES
from grounding.references.function_words import (
    ARRANGING,
    DETERMINERS,
    FUNCTION_WORDS,
    GENERAL,
    GENERIC,
    NOT_OBJECTS,
    NUMBERS,
    PARTICLES,
    SHAPE_WORDS,
    SIDES,
    STRICT_EXCEPTIONS,
    WHAT_FOLLOWS_OBJECTS,
)
from grounding.references.sentence_roles import STOPS, Sentences
from grounding.references.word_forms import singular

MOST_MODIFIERS = 4
_BEFORE_NOUNS = DETERMINERS | frozenset(NUMBERS) | {"of"}
_POSSESSIVE = re.compile(r"(?:'s|s')$")


def unknown_phrase(said: Sentences, place: int, listed: str) -> tuple[int, int, str, bool, bool] | None:
    """Find a phrase at `place` with a noun that is in no table and no name, in a position that requires an object.

    Args:
        said: the words of the text.
        place: the position at which the phrase would start.
        listed: the "," or "and" that joins it to objects before it; empty if there is none.

    Returns: (start of modifiers, place of the noun, its singular, whether it is a plural, False), or `None`.
    """
    word = said.words[place]
    if not listed and not _opens(said, place):
        return None
    first = place
    while said.word(first) in _BEFORE_NOUNS or said.word(first).isdecimal():
        first += 1
    end = first
    while end < len(said.words) and end - first <= MOST_MODIFIERS and said.describes(end):
        end += 1
    content = said.words[first:end]
    if not content or said.word(end) in said.forms or said.word(end) in GENERIC or len(content) > MOST_MODIFIERS:
        return None  # nothing, or the known noun comes later
    if listed and said.word(end) not in (WHAT_FOLLOWS_OBJECTS if listed == "and" else (",", "and", "&")):
        return None
    if said.word(end) in NOT_OBJECTS or _POSSESSIVE.search(content[-1]):
        return None
    while content and (
        content[-1].endswith(("ly", "ing", "ed")) or content[-1] in TELLING_ADJECTIVES or content[-1] in SIDES
    ):
        content.pop()
    plurals = [i for i, w in enumerate(content) if singular(w) != w]
    if not content or (first == place and not plurals):
        return None  # "put together", "a circle of friendship"
    if content[-1] in said.forms:
        return None  # known, and found when its turn comes
    head = first + (plurals[0] if plurals else len(content) - 1)
    if not plurals and word in ("a", "an", "one"):
        return None  # "make a carousel"
    return first, head, singular(said.words[head]), bool(plurals), False


def _opens(said: Sentences, place: int) -> bool:
    """Return whether mostly objects are named from here on."""
    word = said.words[place]
    if (word in FUNCTION_WORDS and word not in _BEFORE_NOUNS) or word in ("of", "that", "this", "it"):
        return False
    exception = said.exception(place)
    if exception in STRICT_EXCEPTIONS and (exception != "but" or said.word(place - 2) in GENERAL):
        return True
    if word in ("a", "an", "one"):
        return False
    before = place - 1
    while said.word(before) in PARTICLES and before > place - 4:
        before -= 1
    previous, earlier = said.word(before), said.word(before - 1)
    if previous in ARRANGING and earlier not in ("i", "he", "she", "they", "we", "to") and earlier not in DETERMINERS:
        return not said.narrated[place]
    if previous in ("want", "need") or (previous == "like" and earlier in ("i'd", "would", "we'd")):
        return word in DETERMINERS and _shape_follows(said, place)
    if previous in ("of", "from", "using"):
        return _shape_before(said, before)
    if place == 0 or (previous in STOPS and said.word(place) in DETERMINERS):
        return _shape_follows(said, place)
    return False


def _shape_before(said: Sentences, place: int) -> bool:
    """Return whether "of", "out of" or "from" follows the noun of a shape: "a ring of"."""
    if said.word(place - 1) in ("out", "made", "consisting"):
        place -= 1
    return said.word(place - 1) in SHAPE_WORDS


def _shape_follows(said: Sentences, place: int) -> bool:
    """Return whether the phrase at the start of a sentence continues with "in a circle" or "into a row"."""
    for start in range(place + 1, min(place + 6, len(said.words))):
        if said.words[start] in ("in", "into") and said.word(start + 1) in ("a", "an", "one"):
            return said.word(start + 2) not in NOT_OBJECTS or said.word(start + 2) in SHAPE_WORDS
        if said.words[start] in FUNCTION_WORDS and said.words[start] not in DETERMINERS:
            return False
    return False
