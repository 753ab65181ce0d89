"""Say what the adjectives of a copied phrase mean: colours, sizes and their degrees, and colours named by a thing."""

from __future__ import annotations

from collections.abc import Mapping

from grounding.references.attributes import COLOR_WORDS, COMPARATIVES, EXPLETIVES, MEASURES, SUPERLATIVES

COLOURS: Mapping[str, tuple[str, ...]] = {
    **COLOR_WORDS,
    "amber": ("brown", "orange", "yellow"), "wine": ("red",), "ruby": ("red",), "cherry": ("red",), "cobalt": ("blue",),
    "sky": ("blue",), "indigo": ("blue", "purple"), "emerald": ("green",), "mint": ("green",), "golden": ("yellow",),
    "lemon": ("yellow",), "mustard": ("yellow",), "canary": ("yellow",), "tangerine": ("orange",), "rust": ("orange",
    "brown"),
    "chocolate": ("brown",), "ebony": ("black",), "charcoal": ("black", "grey"), "snowy": ("white",),
    "silvery": ("grey",),
    "clear": ("clear",), "transparent": ("clear",), "colourless": ("clear",), "yellowy": ("yellow",),
    "pinky": ("pink",),
}  # fmt: skip
# "coloured like the sea", "the colour of blood".
COLOUR_OF: Mapping[str, str] = {
    "sea": "blue", "sky": "blue", "ocean": "blue", "water": "blue", "grass": "green", "leaf": "green",
    "leaves": "green",
    "lemon": "yellow", "sun": "yellow", "banana": "yellow", "canary": "yellow", "blood": "red", "fire": "red",
    "rose": "red",
    "wine": "red", "tomato": "red", "strawberry": "red", "snow": "white", "milk": "white", "coal": "black",
    "night": "black",
    "tangerine": "orange", "carrot": "orange", "chocolate": "brown", "earth": "brown", "lime": "green", "cherry": "red",
    "stop sign": "red", "fire engine": "red", "orange": "orange", "mud": "brown", "soot": "black", "butter": "yellow",
}  # fmt: skip
_SIZES = {
    "tiny": "small", "low": "short", "deep": "tall", "shallow": "short", "skinny": "thin", "squat": "short",
    "stubby": "short", "huge": "large", "giant": "large", "massive": "large", "mini": "small", "petite": "small",
    "lengthy": "long", "bulky": "large", "flattish": "flat", "lanky": "tall",
}  # fmt: skip
# "coloured things", "the warm colours".
_WARM, _COLD = ("red", "orange", "yellow"), ("blue", "green")
TEMPERATURES = {"warm": _WARM, "cold": _COLD, "cool": _COLD}
HUES: Mapping[str, tuple[str, ...]] = {
    **TEMPERATURES, **dict.fromkeys(("coloured", "colourful"), (*_WARM, *_COLD, "pink", "purple", "turquoise")),
}  # fmt: skip
NEUTRAL = ("white", "black", "grey", "clear")
# The size of the middle one of three: "the medium pot"; "the middle pot" may be that of a row instead.
MIDDLE = "middle"
MIDDLING = frozenset("medium middling middle-sized mid-sized medium-sized mid-size".split())
# Adjectives of which nothing in a scene tells, and that no speaker chooses by.
IDLE = EXPLETIVES | frozenset(
    "dear little-old whole entire complete actual blooming own said aforementioned existing present available".split()
)


def colours_of(word: str) -> tuple[str, ...] | None:
    """Return the plain colours that a word names, "red" for "crimson" and "reddish"; `None` where it names none."""
    stem = word.removesuffix("ish")
    forms = (word, stem, stem[:-1], f"{stem}e") if stem != word else (word,)
    return next((COLOURS[form] for form in forms if form in COLOURS), None)


def size_of(word: str) -> tuple[str, str] | None:
    """Return an adjective of `MEASURES` and its degree, "tall" and "most" for "tallest"; `None` for other words."""
    for table, degree in ((SUPERLATIVES, "most"), (COMPARATIVES, "more")):
        if word in table:
            return table[word], degree
    if word in MEASURES or word in _SIZES:
        return _SIZES.get(word, word), ""
    for ending, degree in (("est", "most"), ("er", "more")):
        stem = word.removesuffix(ending)
        for form in (stem, f"{stem}e", stem[:-1], f"{stem[:-1]}y"):
            if stem != word and form in _SIZES:
                return _SIZES[form], degree
    return None
