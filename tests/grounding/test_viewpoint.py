"""What is said from the opposite side of the table: words relative to the robot are put as the speaker's own."""

import pytest

from grounding.viewpoint import spoken_across
from tests.grounding.readers import reader

NAMES = ["cup", "cup", "cup", "can", "can", "bowl"]


@pytest.mark.parametrize(
    ("said", "heard"),
    [
        ("a row on your left", "a row on the right"),
        ("a row to your right, please", "a row to the left, please"),
        ("a row on the robot's left", "a row on the right"),
        ("a row to the left of the robot", "a row to the right"),
        ("on your right-hand side", "on the left-hand side"),
        ("on the left-hand side of the arm", "on the right-hand side"),
        ("on the left from your point of view", "on the right"),
        ("on the right side as seen from the robot", "on the left side"),
        ("close to you", "far from me"),
        ("near the arm", "far from me"),
        ("closer to the robot arm", "farther from me"),
        ("the side nearest the robot", "the side farthest from me"),
        ("on your side of the table", "on the far side of the table"),
        ("right in front of you", "far from me"),
        ("on your left in front of you", "on the right far from me"),
        ("away from you", "close to me"),
        ("as far from you as possible", "as close to me as possible"),
        ("on the far side from you", "on the close side to me"),
        ("move it 5 cm away from you", "move it 5 cm towards me"),
        ("move it 5 cm towards the robot", "move it 5 cm away from me"),
        ("a line facing you", "a line facing away from me"),
        ("a line facing away from the robot", "a line facing toward me"),
        ("a circle open towards you", "a circle open away from me"),
        ("the cups on your left and the cans on my left", "the cups on the right and the cans on my left"),
        (
            "the cups close to you, the cans away from you on your right",
            "the cups far from me, the cans close to me on the left",
        ),
        ("the cans far from the robot and the cup to the right of you", "the cans close to me and the cup to the left"),
    ],
)
def test_places_relative_to_the_robot_are_put_as_the_speakers(said, heard):
    assert spoken_across(said) == heard


@pytest.mark.parametrize(
    "said",
    [
        "could you put them on the left, robot",
        "put the cups on the left for you, you know",
        "would you kindly move it to the right of the bowl",
        "as you like, near me",
        "next to your cup, in front of your mug",
        "near you'll find a cup",
        "place it to the right of the robot's mug",
        "thank you",
    ],
)
def test_what_is_no_place_stays(said):
    assert spoken_across(said) == said


def slots(goal):
    return [(part.x_position, part.y_position, getattr(part, "rotation", None)) for part in goal.parts]


@pytest.fixture(scope="module")
def across():
    return reader("opposite")


@pytest.mark.parametrize("objects", [None, NAMES])
@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("put the cups in a row on the left", [("right", None, None)]),
        ("put the cups in a row on your left", [("left", None, None)]),
        ("put the cups in a row to the right of the robot", [("right", None, None)]),
        ("put the cups in a row on your right-hand side", [("right", None, None)]),
        ("put the cups in a row close to you", [(None, "bottom", None)]),
        ("put the cups in a row close to me", [(None, "top", None)]),
        ("put the cups in a row away from the arm", [(None, "top", None)]),
        ("put the cups in a row on the side nearest the robot", [(None, "bottom", None)]),
        ("put the cups in a row in front of you", [(None, "bottom", None)]),
        ("put the cups in a row facing you", [(None, None, "south")]),
        ("put the cups in a row facing away from the robot", [(None, None, "north")]),
        ("put the cups in a row facing me", [(None, None, "north")]),
        ("could you put the cups in a row on the left, robot", [("right", None, None)]),
    ],
)
def test_an_instruction_from_across(across, objects, text, found):
    reading = across.interpret(text, objects)
    assert (reading.status, slots(reading.goal)) == ("ok", found), reading.message


def test_two_sides_from_across_are_built_in_a_scene_and_without_one(across):
    text, found = (
        "stack the cans on your left and put the cups in a row on my left",
        [("left", None, None), ("right", None, None)],
    )
    for reading in (across.interpret(text, NAMES), across.interpret(text)):
        assert (reading.status, slots(reading.goal)) == ("ok", found), reading.message


ASKS = pytest.mark.xfail(reason="asks whether at the back or at the front", strict=False)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("put it on your right instead", [("right", None, None)]),
        ("put it on the left instead", [("right", None, None)]),
        pytest.param("closer to you, please", [("left", "bottom", None)], marks=ASKS),
        pytest.param("put it far away from you", [("left", "top", None)], marks=ASKS),
        ("no, to the right of the robot", [("right", None, None)]),
        ("make it face you", [("left", None, "south")]),
    ],
)
def test_a_correction_from_across(across, text, found):
    before = across.interpret("put the cups in a row on your left", NAMES).goal
    reading = across.interpret(text, NAMES, before)
    assert (reading.status, slots(reading.goal)) == ("ok", found), reading.message
