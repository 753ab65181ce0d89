"""Names that are listed by their numbers are written out where something is called so, and nowhere else."""

import pytest

from grounding.resolve.numbered_names import numbered_apart

NAMES = ("cup 1", "cup 2", "cup 3", "object 1, red", "object 2", "object 3", "can_1", "can_2", "box")


@pytest.mark.parametrize(
    ("text", "apart"),
    [
        ("put objects 2 and 3 in a line", "put object 2 and object 3 in a line"),
        ("object 1, 2 and 3 in a line", "object 1, object 2 and object 3 in a line"),
        ("line up objects 1 to 3", "line up object 1, object 2 and object 3"),
        ("Cups 1-3 in a circle", "cup 1, cup 2 and cup 3 in a circle"),
        ("stack cans 1 & 2", "stack can 1 and can 2"),
        ("cups 1, 2, and 3.", "cup 1, cup 2 and cup 3."),
        ("put cup 1, 2 cm to the left of the box", None),  # a length
        ("put can 1 and 2 cups in a line", None),  # a count
        ("put objects 2 and 6 in a line", "put object 2 and object 6 in a line"),  # which is missing, is said later
        ("put object 2 and 6 cups in a line", None),
        ("put objects 5 and 6 in a line", None),  # nothing is called so
        ("put mugs 1 and 2 in a line", None),
        ("a grid of 2 and 3", None),
    ],
)
def test_numbers(text, apart):
    assert numbered_apart(text, NAMES) == (apart or text)


def test_nothing_is_changed_where_nothing_has_a_number():
    assert numbered_apart("objects 1 and 2", ("mug", None)) == "objects 1 and 2"
