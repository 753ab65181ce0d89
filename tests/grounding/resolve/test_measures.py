"""Lengths are read in words and digits, with their units."""

from __future__ import annotations

import pytest

from grounding.resolve.measures import lengths_of
from grounding.resolve.tokens import split


@pytest.mark.parametrize(
    ("said", "metres"),
    [
        ("half a metre", 0.5),
        ("a quarter of a metre", 0.25),
        ("three quarters of an inch", 0.01905),
        ("two thirds of a metre", 0.666667),
        ("a half inch", 0.0127),
        ("one tenth of a metre", 0.1),
        ("an inch and a half", 0.0381),
        ("a foot and a half", 0.4572),
        ("two and a half inches", 0.0635),
        ("a couple of inches", 0.0508),
        ("about 12 cm or so", 0.12),
    ],
)
def test_words_are_lengths(said, metres):
    assert lengths_of(split(f"leave {said} between them")) == {1: (metres, 1 + len(said.split()))}


@pytest.mark.parametrize("said", ["half of the cups", "a third row", "2 to 3 cm", "in the left half of a table"])
def test_other_shares_are_no_lengths(said):
    assert lengths_of(split(said)) == {}
