"""Relations that hold one by one between the objects of two kinds."""

from __future__ import annotations

import pytest

from grounding.goal_reading.reader import GoalReader
from grounding.interpreter import Interpreter

TABLE = ("can", "can", "can", "cup", "cup", "cup", "cup", "bowl")
SPOONS = ("spoon", "spoon", "mug", "mug", "plate")


@pytest.mark.parametrize(
    ("text", "names", "goal"),
    [
        ("put each can behind a cup", TABLE, "0 behind 3; 1 behind 4; 2 behind 5"),
        ("put each can 10 cm behind a cup", TABLE, "0 behind 3 by 10 cm; 1 behind 4 by 10 cm; 2 behind 5 by 10 cm"),
        ("place a cup beside every can", TABLE, "3 next to 0; 4 next to 1; 5 next to 2"),
        ("a spoon in every mug and the plate on the left", SPOONS, "0 in 2; 1 in 3; 4 at left"),
        ("put the spoons in the mugs", SPOONS, "0 in 2; 1 in 3"),
        ("put the spoons on the plate", SPOONS, "0, 1 on 4"),
        ("put the plate next to each mug", SPOONS, "4 next to 2, 3"),
    ],
)
def test_each_gets_one(text, names, goal):
    found = GoalReader().read(text, names)
    assert str(found.goal) == goal and found.complete


@pytest.mark.parametrize(
    ("text", "names", "words"),
    [
        ("put a can in every cup", TABLE, "needs 4 of 'can', one for each, and there are 3"),
        ("put every cup next to a can", TABLE, "needs 4 of 'can', one for each, and there are 3"),
        ("put the cans in the cups", TABLE, "there are 3 objects for 4; name them one by one"),
        ("one spoon per mug", SPOONS, "one spoon per"),
        ("put each spoon next to its own mug", SPOONS, "its own"),
    ],
)
def test_without_a_partner_for_each_nothing_is_built(text, names, words, parser, encoder):
    found = Interpreter(lambda: parser, encoder=encoder).interpret(text, names)
    assert found.status == "refused" and words in found.message
