"""What of a correction was not parsed: places of single objects, orders and lengths, but not which objects are meant."""

import re

import pytest

from grounding.dialogue.unread import unread_words


@pytest.mark.parametrize(
    ("text", "unread"),
    [
        ("put the three tallest objects in a line", ()),
        ("the longest object in a line", ()),
        ("the tallest one in the middle", ("the tallest one in the middle",)),
        ("biggest first", ("biggest first",)),
        ("by length", ("by length",)),
        ("two fingers to the left", ("two fingers",)),
        ("a couple of inches", ("a couple of inches",)),
    ],
)
def test_what_was_not_parsed_is_named(text, unread):
    assert unread_words(text, [], None, (), re.compile(r"\b(?:line|left)\b")) == unread
