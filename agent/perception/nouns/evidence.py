"""Weigh what the picture shows against what the shape allows: noun -> confidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

_TABLE = Path(__file__).with_name("noun_shapes.tsv")
# Weights of the shape's and the picture's probabilities, the share that every noun has in the picture at least, and
# that of everything without a noun: chosen on textured scans (docs/recordings.md, "Nouns").
SHAPE_WEIGHT, PICTURE_WEIGHT, FLOOR, UNKNOWN = 1.3, 1.0, 0.01, 0.1
# Shapes that are a noun by themselves, and those that only support one that the picture shows.
_SHOWN_BY_SHAPE = frozenset("mug cup bowl plate can bottle box pan pitcher".split())
# Nouns of things that people call by either; the first two of them that are likely name an object together.
_KIN = (frozenset(("cup", "mug", "glass")), frozenset(("book", "notebook")))
_TOLERANCE = 1.2  # of sizes: what is seen of an object can be smaller or, with its shadow, larger


@dataclass(frozen=True)
class _Shapes:
    """What an object with a noun looks like.

    Attributes:
        kinds: the kinds of shape that it can have.
        least, most: its longest side, metres.
    """

    kinds: frozenset[str]
    least: float
    most: float


@lru_cache(maxsize=1)
def _table() -> dict[str, _Shapes]:
    rows = [line.split("\t") for line in _TABLE.read_text(encoding="utf-8").splitlines()]
    return {
        noun: _Shapes(frozenset(kinds.split()), float(least) / 100, float(most) / 100)
        for noun, kinds, least, most in rows
    }


def confidences(picture: Mapping[str, float], shape: Mapping[str, float], sides: np.ndarray) -> dict[str, float]:
    """Return noun -> confidence, the highest first; what is missing to 1 has no noun here.

    Args:
        picture: noun -> probability, by the picture alone.
        shape: kind of shape -> probability, by the depth alone.
        sides: (3,) of the object's box, metres.
    """
    longest = float(np.max(sides))
    scores = {}
    for noun, fits in _table().items():
        if not fits.least / _TOLERANCE <= longest <= fits.most * _TOLERANCE:
            continue
        seen = picture.get(noun, 0.0) + (FLOOR if noun in _SHOWN_BY_SHAPE else 0.0)
        allowed = sum(shape.get(kind, 0.0) for kind in fits.kinds)
        scores[noun] = allowed**SHAPE_WEIGHT * seen**PICTURE_WEIGHT
    nameless = (1.0 - sum(shape.get(kind, 0.0) for kind in _SHOWN_BY_SHAPE)) ** SHAPE_WEIGHT * UNKNOWN**PICTURE_WEIGHT
    whole = sum(scores.values()) + nameless
    found = {noun: score / whole for noun, score in scores.items()}
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def likeliest(nouns: Mapping[str, float], least: float) -> tuple[str, ...]:
    """Return the noun with a confidence of at least `least`, or two kin that have it together, or none.

    Args:
        nouns: noun -> confidence, the highest first.
        least: confidence that a name takes.
    """
    first = next(iter(nouns), "")
    if nouns.get(first, 0.0) >= least:
        return (first,)
    kin = next((kin for kin in _KIN if first in kin), frozenset())
    pair = tuple(noun for noun in nouns if noun in kin)[:2]
    return pair if sum(nouns[noun] for noun in pair) >= least else ()
