"""Decide which objects an adjective fits, from the attributes that a scene knows besides their names.

Colours are words, measures are metres. "Tall" and "small" are judged among the objects that the noun allows: the tall
cups are those above the widest step between the heights of the cups.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from grounding.resolve.lexicon import ADJECTIVES, COLOURS, SAME_WORDS, table

# Heights (or lengths, or widths) that differ by less than this are alike to the eye; volumes by the cube of it.
PERCEIVED_RATIO = 1.12
# A tie between two largest or smallest objects: measures of a depth camera are not better than this.
TIED_RATIO = 1.03

COLOR_WORDS: Mapping[str, tuple[str, ...]] = {
    **{word: (SAME_WORDS.get(word, word),) for word in COLOURS}, **table("colour_words"),
}  # fmt: skip


@dataclass(frozen=True)
class ObjectAttributes:
    """The known attributes of one object.

    Attributes:
        colors: the words that name its colour, the best first, spelled as in `COLOR_WORDS`; empty where unknown.
        size: (length, width, height) in metres, the length being the longer horizontal side; `None` where unknown.
        position: (x, y) of its centre in the world frame, metres; `None` where unknown, as in a library.
    """

    colors: tuple[str, ...] = ()
    size: tuple[float, float, float] | None = None
    position: tuple[float, float] | None = None


@dataclass(frozen=True)
class SceneObject:
    """An object as an instruction can refer to it.

    Attributes:
        name: a noun ("mug"), a compound ("soup can") or a description ("object 3, red, tall"); may be empty.
        attributes: its known attributes, or `None`.
    """

    name: str
    attributes: ObjectAttributes | None = None


def scene_objects(objects: Sequence[SceneObject | str | None] | None) -> tuple[SceneObject, ...] | None:
    """Return objects of which only the names are known, or not even these, as objects of a scene."""
    if objects is None:
        return None
    return tuple(each if isinstance(each, SceneObject) else SceneObject(each or "") for each in objects)


def _volume(size: tuple[float, float, float]) -> float:
    return size[0] * size[1] * size[2]


@dataclass(frozen=True)
class Measure:
    """The measure that an adjective of size compares.

    Attributes:
        of: gives the number that is compared, from (length, width, height).
        sign: 1 if more of it is meant, -1 if less.
        ratio: what differs by less is alike.
        noun: the plural noun for the number.
    """

    of: Callable[[tuple[float, float, float]], float]
    sign: int
    ratio: float
    noun: str


def _measures() -> dict[str, Measure]:
    kinds = (
        (_volume, PERCEIVED_RATIO**3, "sizes", "large big", "small little"),
        (lambda size: size[2], PERCEIVED_RATIO, "heights", "tall high", "short low flat"),
        (lambda size: size[1], PERCEIVED_RATIO, "widths", "wide broad thick fat", "narrow thin slim slender"),
        (lambda size: size[0], PERCEIVED_RATIO, "lengths", "long", ""),
    )
    found: dict[str, Measure] = {}
    for of, ratio, noun, more, less in kinds:
        for words, sign in ((more, 1), (less, -1)):
            found |= {word: Measure(of, sign, ratio, noun) for word in words.split()}
    return found


MEASURES: Mapping[str, Measure] = _measures()


def _compared(ending: str) -> dict[str, str]:
    """Return comparative or superlative -> the plain adjective of size."""
    forms = {}
    for word in MEASURES:
        stem = word.removesuffix("e")
        doubled = stem + stem[-1] if word in ("big", "thin", "fat", "flat", "slim") else stem
        forms[doubled + ending] = word
    return forms


SUPERLATIVES: Mapping[str, str] = _compared("est")
COMPARATIVES: Mapping[str, str] = _compared("er")
# Properties that no camera or measure of ours can tell: where a name does not hold them, that is said.
UNJUDGED = frozenset(
    "heavy heavier heaviest light lighter lightest wooden plastic metal ceramic glass paper cardboard foam rubber soft "
    "hard shiny matte glossy smooth rough clean dirty new old full empty hot cold warm wet dry broken cracked fragile "
    "expensive cheap sharp blunt transparent opaque striped spotted dotted patterned coloured colored colourful "
    "colorful round square rectangular cylindrical oval curved hollow solid open closed ripe rotten fresh pretty ugly "
    "nice favourite favorite dark pale bright".split()
)

# What speakers put before a noun without choosing by it.
EXPLETIVES = frozenset(
    "damn damned darn bloody silly stupid freaking fricking flipping blasted ruddy wretched poor lonely lovely goddamn "
    "effing fancy".split()
)

# Every word that may tell one object from another of its kind.
TELLING_ADJECTIVES = ADJECTIVES | frozenset((*SAME_WORDS, *COLOR_WORDS, *MEASURES, *SUPERLATIVES)) | UNJUDGED


def of_size(word: str, objects: Sequence[ObjectAttributes | None]) -> list[int] | None:
    """Find the objects that an adjective of size fits, compared with each other.

    They are those beyond the widest step in the sorted measures; none if no step can be seen.

    Args:
        word: one of `MEASURES`.
        objects: the known attributes of each object.

    Returns:
        Indices, or `None` if it cannot be judged: an object has no size, or there is nothing to compare it with.
    """
    values, order = _values(word, objects), by_size(word, objects)
    if values is None or order is None or len(values) < 2:
        return None
    steps = [_ratio(values[a], values[b]) for a, b in zip(order, order[1:], strict=False)]
    widest = max(range(len(steps)), key=lambda i: steps[i])
    return [] if steps[widest] < MEASURES[word].ratio else sorted(order[: widest + 1])


def by_size(word: str, objects: Sequence[ObjectAttributes | None]) -> list[int] | None:
    """Sort objects by a measure, the one that the superlative means first; `None` if one has no size.

    Args:
        word: one of `MEASURES`: "tall" for "the tallest".
        objects: the known attributes of each object.
    """
    values = _values(word, objects)
    if values is None:
        return None
    return sorted(range(len(values)), key=lambda i: -MEASURES[word].sign * values[i])


def alike(word: str, one: ObjectAttributes, other: ObjectAttributes) -> bool:
    """Tell whether two objects are too alike in a measure to say which has more of it."""
    values = _values(word, (one, other))
    exponent = 3 if MEASURES[word].noun == "sizes" else 1
    return values is not None and _ratio(*values) < TIED_RATIO**exponent


def _values(word: str, objects: Sequence[ObjectAttributes | None]) -> list[float] | None:
    if any(each is None or each.size is None for each in objects):
        return None
    return [MEASURES[word].of(each.size) for each in objects]  # type: ignore[union-attr, arg-type]


def _ratio(one: float, other: float) -> float:
    low, high = sorted((one, other))
    return high / max(low, 1e-9)
