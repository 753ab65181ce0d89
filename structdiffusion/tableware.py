"""Nouns whose meaning a table setting depends on, and their numbers in the networks."""

from __future__ import annotations

from collections.abc import Sequence

# Things with a front: it points away from the diner.
CUTLERY = ("fork", "knife", "spoon")
# What can be the base of a setting, and the drinkware in it.
BASES = ("plate", "bowl")
DRINKWARE = ("cup", "mug")
NOUNS = BASES + CUTLERY + DRINKWARE


def noun_ids(categories: Sequence[str], nouns: tuple[str, ...] = NOUNS) -> list[int]:
    """Return the noun id of each category: its place among the nouns, from 1; 0 for a category that is none of them."""
    return [nouns.index(category) + 1 if category in nouns else 0 for category in categories]
