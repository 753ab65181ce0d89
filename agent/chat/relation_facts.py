"""Find which objects stand on, beside or in a direction from others, with the tolerances of the evaluation protocol."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from agent.chat.table_facts import Fact
from grounding.dialogue.act_words import REGIONS
from structdiffusion.evaluation_protocol import (
    BETWEEN_SHARES,
    MAX_NEXT_TO_GAP,
    MAX_OFF_BETWEEN,
    MAX_RELATION_OFF_DEGREES,
)

_DIRECTIONS = {"left of": (0.0, 1.0), "right of": (0.0, -1.0), "behind": (1.0, 0.0), "in front of": (-1.0, 0.0)}
_HEADINGS = ("left of", "behind", "right of", "in front of")
_REGION_WORDS = frozenset("the your my very far near side half part end edge of table".split())


def region_of(words: str) -> str:
    """Return the region of the table that the words mean, as named in `Fact.place`; empty if they mean none."""
    left_over = [word for word in words.split() if word not in _REGION_WORDS]
    return REGIONS.get(left_over[0], "") if len(left_over) == 1 else ""


def in_region(one: Fact, region: str) -> bool:
    """Return whether an object stands in a region of the table, one of the values of `REGIONS`."""
    if region == "middle":
        return "in the middle" in one.place or "in the center" in one.place
    return region in one.place


def clear_gap(one: Fact, other: Fact) -> float:
    """Return the clear distance between two objects as seen from above, metres."""
    return float(one.outline.distance(other.outline))


def direction_from(reference: Fact, one: Fact, viewpoint: str) -> str:
    """Return the nearest of the four directions in which an object stands from a reference, as the speaker sees it."""
    return max(_HEADINGS, key=lambda name: _along(reference, one, name, viewpoint))


def related(one: Fact, relation: str, references: Sequence[Fact], viewpoint: str) -> bool:
    """Return whether an object is in a relation to any of the references; for "between", to both of two.

    Args:
        one: the facts of the object.
        relation: one of the values of `grounding.dialogue.act_words.RELATIONS_SAID` except "nearest".
        references: the facts of the other objects; the object itself is ignored.
        viewpoint: whose left and right is meant.
    """
    others = [each for each in references if each.name != one.name]
    if relation == "between":
        return len(others) == 2 and _between(one, *others)
    return any(_stands(one, relation, other, viewpoint) for other in others)


def _stands(one: Fact, relation: str, other: Fact, viewpoint: str) -> bool:
    if relation in ("on", "in"):
        return one.on == other.name
    if relation == "under":
        return other.on == one.name
    if other.name == one.on or one.name == other.on:
        return False
    if relation == "next to":
        return clear_gap(one, other) <= MAX_NEXT_TO_GAP
    return _along(other, one, relation, viewpoint) >= math.cos(math.radians(MAX_RELATION_OFF_DEGREES))


def _along(reference: Fact, one: Fact, direction: str, viewpoint: str) -> float:
    """Return the cosine of the angle between a direction, as the speaker sees it, and the way to the object."""
    way = np.subtract(one.position[:2], reference.position[:2])
    towards = np.array(_DIRECTIONS[direction]) * (-1 if viewpoint == "opposite" else 1)
    return float(way @ towards / max(float(np.hypot(*way)), 1e-9))


def _between(one: Fact, first: Fact, second: Fact) -> bool:
    start, way = np.array(first.position[:2]), np.subtract(second.position[:2], first.position[:2])
    length = max(float(np.hypot(*way)), 1e-9)
    from_start = np.array(one.position[:2]) - start
    share = float(from_start @ way) / length**2
    off = abs(float(way[0] * from_start[1] - way[1] * from_start[0])) / length
    return BETWEEN_SHARES[0] <= share <= BETWEEN_SHARES[1] and off <= MAX_OFF_BETWEEN
