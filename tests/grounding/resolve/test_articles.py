"""What there is one of is named by "the"."""

import pytest

from grounding.resolve.articles import definite_where_single

NAMES = ("red cup", "blue cup", "plate", "coffee_can", "can 2", "fork, silver", None)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("put a fork next to a plate", "put the fork next to the plate"),
        ("Put ANY Fork there", "Put the Fork there"),
        ("a silver fork", "the silver fork"),
        ("put a cup on a can", "put a cup on a can"),  # there are two of each
        ("a plate cup", "a plate cup"),
        ("a line of plate and fork", "a line of plate and fork"),
        ("round like a plate, as a plate", "round like a plate, as a plate"),
        ("a plateau", "a plateau"),
        ("a forks", "a forks"),
    ],
)
def test_articles(text, said):
    assert definite_where_single(text, NAMES) == said


def test_without_names_nothing_changes():
    assert definite_where_single("put a fork next to a plate", ()) == "put a fork next to a plate"
