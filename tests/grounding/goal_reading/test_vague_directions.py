"""Directions that no relation holds are refused with the ones that can be asked for, and never halved."""

import pytest

from grounding.goal_network.writer import NetworkWriter
from grounding.goals.parts import RelationPart
from grounding.interpreter import Interpreter

DINNER = ["plate", "fork", "knife", "spoon", "cup", "bowl"]


@pytest.fixture(scope="module")
def interpreter(parser, encoder):
    return Interpreter(lambda: parser, encoder=encoder, network=lambda: NetworkWriter.from_pretrained(encoder))


@pytest.mark.parametrize(
    ("text", "one", "other"),
    [
        ("put the cup at the top right of the plate", "behind", "right of"),
        ("put the spoon on the top right of the plate", "behind", "right of"),
        ("the cup goes to the upper left of the plate", "behind", "left of"),
        ("fork at the bottom left of the plate", "in front of", "left of"),
        ("put the bowl left behind the plate", "left of", "behind"),
        ("the cup goes behind and to the right of the plate", "behind", "right of"),
        ("cup left of and in front of the plate", "left of", "in front of"),
    ],
)
def test_between_two_directions(interpreter, text, one, other):
    found = interpreter.interpret(text, DINNER)
    assert (found.status, found.goal.parts) == ("refused", ())
    assert f"“{one}” or “{other}”" in found.message


@pytest.mark.parametrize("text", ["fork far from the plate", "the spoon in the bowl and the cup far away from it"])
def test_away_from_an_object(interpreter, text):
    found = interpreter.interpret(text, DINNER)
    assert found.status == "refused" and ("how far" in found.message or "away" in found.message)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("cup right behind the plate", [RelationPart("behind", (4,), (0,))]),
        ("put the bowl far away from me", [RelationPart("at", (5,), y_position="top")]),
        ("cup at the top left of the table", [RelationPart("at", (4,), x_position="left", y_position="top")]),
        ("put the cup on the plate's right side", [RelationPart("right of", (4,), (0,))]),
        (
            "the bowl on the left, in front of the plate",
            [RelationPart("at", (5,), x_position="left"), RelationPart("in front of", (5,), (0,))],
        ),
        (
            "cup at the back right of the table, behind the plate",
            [RelationPart("at", (4,), x_position="right", y_position="top"), RelationPart("behind", (4,), (0,))],
        ),
    ],
)
def test_one_direction_and_places_on_the_table(interpreter, text, parts):
    found = interpreter.interpret(text, DINNER)
    assert found.status == "ok", found.message
    assert list(found.goal.parts) == parts


@pytest.mark.parametrize(
    ("text", "on"),
    [
        ("stack the bowl on the plate and put the cup on top", 5),
        ("put the bowl on the plate and the cup on top", 5),
    ],
)
def test_on_top_is_the_top_of_what_was_stacked(interpreter, text, on):
    assert interpreter.interpret(text, DINNER).goal.parts[1] == RelationPart("on", (4,), (on,))


@pytest.mark.parametrize("text", ["put the cup between me and the plate", "cup between the plate and me"])
def test_between_the_speaker_and_an_object_is_in_front_of_it(interpreter, text):
    assert interpreter.interpret(text, DINNER).goal.parts == (RelationPart("in front of", (4,), (0,)),)


def test_that_is_what_was_placed_last_in_the_same_relation(interpreter):
    found = interpreter.interpret("put the cup behind the plate and the bowl behind that", DINNER)
    assert found.goal.parts[1] == RelationPart("behind", (5,), (4,))


def test_how_an_object_lies_is_not_dropped(interpreter):
    found = interpreter.interpret("the spoon on top of the plate, parallel to the front edge", DINNER)
    assert (found.status, found.goal.parts) == ("refused", ())


def test_one_thing_for_a_use_is_one_object(interpreter):
    found = interpreter.interpret("put the thing I eat with next to the cup", DINNER)
    assert found.status == "ask" and {"fork", "knife", "spoon"} & set(found.question.options)
