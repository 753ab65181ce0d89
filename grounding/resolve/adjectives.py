"""Say what the words mean by which a copied phrase describes objects: colours, sizes, properties and uses."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from grounding.resolve.attributes import COLOR_WORDS, COMPARATIVES, EXPLETIVES, MEASURES, SUPERLATIVES
from grounding.resolve.lexicon import listed, pairs, table, tables

COLOURS: Mapping[str, tuple[str, ...]] = {**COLOR_WORDS, **table("likened_colours")}
COLOUR_OF = pairs("colour_of")
COLOURFUL = ("coloured", "colourful", "colorful")  # of any colour but these:
NEUTRAL = ("white", "black", "grey", "clear")
_SIZES = {
    "tiny": "small", "low": "short", "deep": "tall", "shallow": "short", "skinny": "thin", "squat": "short",
    "stubby": "short", "huge": "large", "giant": "large", "massive": "large", "mini": "small", "petite": "small",
    "lengthy": "long", "bulky": "large", "flattish": "flat", "lanky": "tall",
}  # fmt: skip
# The size of the middle one of three: "the medium pot"; "the middle pot" may be that of a row instead.
MIDDLE = "middle"
MIDDLING = frozenset("medium middling middle-sized mid-sized medium-sized mid-size".split())
# Adjectives of which nothing in a scene tells, and that no speaker chooses by.
IDLE = EXPLETIVES | frozenset(
    "very dear little-old whole entire complete actual blooming own said aforementioned existing present "
    "available".split()
)


def colours_of(word: str) -> tuple[str, ...] | None:
    """Return the plain colours that a word names, "red" for "crimson" and "reddish"; `None` where it names none."""
    stem = word.removesuffix("ish")
    forms = (word, stem, stem[:-1], f"{stem}e") if stem != word else (word,)
    return next((COLOURS[form] for form in forms if form in COLOURS), None)


def size_of(word: str) -> tuple[str, str] | None:
    """Return an adjective of `MEASURES` and its degree, "tall" and "most" for "tallest"; `None` for other words."""
    for forms, degree in ((SUPERLATIVES, "most"), (COMPARATIVES, "more")):
        if word in forms:
            return forms[word], degree
    if word in MEASURES or word in _SIZES:
        return _SIZES.get(word, word), ""
    for ending, degree in (("est", "most"), ("er", "more")):
        stem = word.removesuffix(ending)
        for form in (stem, f"{stem}e", stem[:-1], f"{stem[:-1]}y"):
            if stem != word and form in _SIZES:
                return _SIZES[form], degree
    return None


@dataclass(frozen=True)
class Property:
    """Which nouns have a property.

    Attributes:
        tiers: nouns that have it, the surest first.
        open: nouns of which some have it.
    """

    tiers: tuple[tuple[str, ...], ...]
    open: tuple[str, ...] = ()


def _properties() -> Mapping[str, Property]:
    found = {}
    for name, told in tables("properties").items():
        found[name] = Property(tuple(map(listed, told["tiers"])), listed(told.get("open", "")))
    return found


PROPERTIES = _properties()
SAME_PROPERTY = pairs("same_property")
_USES = [(re.compile(pattern), listed(kinds)) for pattern, kinds in pairs("purposes").items()]


def use_of(words: str) -> tuple[str, ...] | None:
    """Return the nouns of what is used as some words say, "drink from"; `None` where no table knows."""
    return next((kinds for pattern, kinds in _USES if pattern.fullmatch(words)), None)


def property_of(word: str) -> Property | None:
    """Return the property that an adjective or a noun for a part names; `None` where no table knows it."""
    return PROPERTIES.get(SAME_PROPERTY.get(word, word))
