"""Which words change a wish although no part of a goal is copied from them."""

import pytest

from grounding.goal_network.weighty_words import unknown_words, weighty, words_held
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("half of the cups", True),
        ("the left half", False),
        ("in a half circle", False),
        ("upside down", True),
        ("a row", False),
    ],
)
def test_half_is_weighty_unless_it_is_an_arc_or_a_side(words, expected):
    assert weighty(words.split()) == expected


def test_a_goal_holds_the_open_side_of_an_arc_and_all_of_a_kind():
    arc = Goal((StructurePart("arc", rotation="west", objects=(0, 1, 2)),))
    line = Goal((StructurePart("line", objects=(0, 1)),))
    assert "open" in words_held(arc, "open to the left") and "open" not in words_held(line, "open the box")
    assert "every" in words_held(line, "every cup") and "every" not in words_held(line, "every second cup")


def test_words_that_were_not_taught_or_that_no_goal_holds_are_unknown():
    assert unknown_words(("gronk", "left", "tilted", "touching", ","), {"left"}) == ("gronk", "tilted", "touching")
