"""Corrections as strangers say them: exchanged and joining objects, other edges and ends, and what has no words."""

from __future__ import annotations

from dataclasses import replace

import pytest

from grounding.dialogue.revise_goal import revise_goal
from grounding.dialogue.scene_reader import SceneReader
from grounding.goals.goal import Goal
from grounding.goals.parts import Order, PartReference, RelationPart, StructurePart
from grounding.interpreter import Interpreter

NAMES = ("red cup", "blue cup", "green cup", "plate", "bowl", "banana", "tall can", "small can", "apple")
LINE = StructurePart("line", objects=(0, 1, 2))
NEAR = StructurePart("line", objects=(0, 1, 2), along="near")
BY_HEIGHT = StructurePart("line", objects=(0, 6, 7), order=Order("height", "descending", "left"))
BY_VOLUME = StructurePart("tower", objects=(3, 6, 7), order=Order("volume", "descending", "bottom"))
LISTED = StructurePart("line", objects=(3, 4, 5), order=Order("listed", None, "left"))
TOWER = StructurePart("tower", objects=(6, 7))
ARC = StructurePart("arc", objects=(0, 1, 2), rotation="south")
BESIDE = RelationPart("left of", (4,), (3,))
AFTER = RelationPart("right of", (5,), (3,))


@pytest.fixture
def say(parser, encoder):
    interpreter = Interpreter(lambda: parser, None, "robot", encoder)

    def revised(parts, text, **more):
        return revise_goal(Goal(parts), text, SceneReader(interpreter, NAMES), NAMES, encoder=encoder, **more)

    return revised


@pytest.mark.parametrize(
    ("parts", "text", "then"),
    [
        ((LINE, TOWER), "the red cup out, the banana in", "line of 5, 1, 2; tower of 6, 7"),
        ((LINE, TOWER), "banana in, red cup out please", "line of 5, 1, 2; tower of 6, 7"),
        ((LINE, TOWER), "the banana, not the red cup", "line of 5, 1, 2; tower of 6, 7"),
        ((LINE, TOWER), "use the bowl instead of the green cup", "line of 0, 1, 4; tower of 6, 7"),
        ((BESIDE, TOWER), "the apple in place of the bowl", "8 left of 3; tower of 6, 7"),
        ((LINE, TOWER), "the banana should join the line", "line of 0, 1, 2, 5; tower of 6, 7"),
        ((LINE, TOWER), "the bowl and the plate in the line too", "line of 0, 1, 2, 4, 3; tower of 6, 7"),
        ((LISTED,), "bowl and banana change places", "line of 3, 5, 4, order by listed from left"),
        ((BESIDE, AFTER), "bowl and banana swapped", "5 left of 3; 4 right of 3"),
        ((NEAR,), "the left edge, I meant", "line of 0, 1, 2, along left"),
        ((NEAR,), "no, along the opposite edge", "line of 0, 1, 2, along far"),
        ((NEAR,), "the far edge, not the near one", "line of 0, 1, 2, along far"),
        ((NEAR, TOWER), "the line along the edge away from me", "line of 0, 1, 2, along far; tower of 6, 7"),
        ((BY_HEIGHT,), "the tallest should be at the right end, not left",
         "line of 0, 6, 7, order by height descending from right"),
        ((BY_HEIGHT,), "same order, but starting from the right",
         "line of 0, 6, 7, order by height descending from right"),
        ((LISTED,), "from the right, same order", "line of 3, 4, 5, order by listed from right"),
        ((LINE, TOWER), "On second thoughts, use the bowl instead of the green cup", "line of 0, 1, 4; tower of 6, 7"),
        ((TOWER, ARC), "cans left, cups right", "tower of 6, 7, left; arc of 0, 1, 2, right, facing south"),
        ((TOWER,), "reds in the tower too", "tower of 6, 7, 0"),
        ((BY_HEIGHT,), "reverse", "line of 0, 6, 7, order by height ascending from left"),
    ],
)  # fmt: skip
def test_what_is_said_is_changed(say, parts, text, then):
    found = say(parts, text)
    goal = found.goal if found.plain is None else found.plain
    assert (found.status, str(goal)) == ("ok", then), found.message


@pytest.mark.parametrize(
    ("parts", "text"),
    [
        ((LINE, TOWER), "the green cup doesn't belong"),  # no line of the green cup
        ((LINE, TOWER), "the apple out, the banana in"),  # neither is in it
        ((LINE,), "right edge"),  # no structure of everything
        ((LINE, TOWER), "big ring"),
        ((ARC,), "open away from me"),  # no circle
        ((LISTED,), "bowl before the plate, silly me"),  # no new goal of the two
        ((LINE,), "the left side and the back"),  # not the left alone
        ((BY_HEIGHT,), "biggest left"),  # no large line
        ((BESIDE, AFTER), "the bowl right of the plate as well"),  # it has one place
        ((LINE, TOWER), "a cup out, the banana in"),  # which of the three
        ((LISTED,), "the apple comes after the banana"),  # the others stay
        ((LISTED,), "let the apple stand in for the banana, it's riper"),
        ((LINE, TOWER), "without the can"),  # not both
        ((LINE, RelationPart("on", (8, 5), (3,))), "only the apple on the plate, not both"),  # the line stays
        ((StructurePart("line"),), "leave the apple where it stands, row without it"),
        ((NEAR,), "it should be on the left, thanks"),  # of the table, or along another edge
        ((StructurePart("cluster", objects=(0, 1, 2)),), "keep that heap small"),  # no tower
        ((TOWER, ARC), "turn that arc around so that it opens away from me"),  # no circle
        ((TOWER,), "the apple on top"),  # not at the back of the table
        ((StructurePart("line", objects=(0, 6, 7), y_position="top"),), "no, not the back, the left side I mean"),
        ((TOWER, RelationPart("behind", PartReference(0), (4,))), "tower in front"),  # of the bowl, or of the table
        ((BY_HEIGHT,), "shortest right"),  # the order, not a place of the shortest thing
        ((BESIDE,), "the apple goes in that spot"),
        ((TOWER, LINE), "one can in the middle of the line instead"),  # not the line in the middle of the table
        ((BY_VOLUME,), "flip it, small one down the bottom"),  # not at the front of the table
        ((replace(TOWER, x_position="right"),), "at the back, not off to the right"),
        ((StructurePart("table setting", x_position="right"),), "only plate and bowl, the side is the same"),
        ((LINE, BESIDE), "swap the red cup and the apple"),  # instead of it, or both exchange places
        ((StructurePart("line", objects=(3, 4)), BESIDE), "the can should join the line"),  # which of the two
    ],
)
def test_what_it_has_no_words_for_is_not_changed(say, parts, text):
    found = say(parts, text)
    assert (found.status, found.goal) in (("refused", Goal(parts)), ("ask", Goal(parts))) or (
        text in {"open away from me", "right edge", "the left side and the back"} and _as_said(found, parts[0], text)
    ), (found.status, str(found.goal), found.message)


def _as_said(found, before, text):
    """Return whether what changed is what the sentence has words for."""
    part = found.goal.parts[0] if found.plain is None else found.plain.spec
    if text == "open away from me":
        return (part.shape, part.rotation) == ("arc", "north")
    return part.x_position == "right" or (part.x_position, part.y_position) == ("left", "top")


def test_reason_is_told_and_names_the_words(say):
    assert "'bowl' would be left out" in say((LINE, TOWER), "bowl, and the line on the left").message or (
        say((LINE, TOWER), "bowl, and the line on the left").status != "ok"
    )
    found = say((StructurePart("line", objects=(0, 1, 2), along="left"),), "make it 20 cm longer to the right")
    assert found.status != "ok" or found.goal.parts[0].along == "left"


def test_move_that_stands_goes_on_from_where_it_ended(say):
    moved = (RelationPart("moved", (0,), direction="left", distance=0.1),)
    assert say(moved, "make that 4 cm", built=True).goal.parts[0].direction == "right"


def test_reference_to_a_part_survives_an_exchange(say):
    parts = (LINE, RelationPart("behind", PartReference(0), (3,)))
    found = say(parts, "the apple in place of the plate")
    assert found.goal == Goal((LINE, RelationPart("behind", PartReference(0), (8,))))
