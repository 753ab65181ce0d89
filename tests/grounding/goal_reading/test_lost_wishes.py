"""Words of a plain structure that surely ask for something are never dropped."""

import pytest

from grounding.goal_network.writer import NetworkWriter
from grounding.interpreter import Interpreter
from tests.grounding.goal_reading.test_reader import SCENES, interpreter  # noqa: F401


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("line up the cans, runts foremost", "foremost"),
        ("put the cups in a circle, titchiest one leading", "titchiest"),
        ("put the cups in a row, first the yellow, last the white", "the yellow"),
        ("The red cups are off limits. Put everything in a circle.", "limits"),
        ("put the cups in a circle, bigger to the left", "bigger"),
        ("line up the cups in rising sequence", "rising"),
        ("stack the cups, upended", "upended"),
        ("put the cups in a circle, cans elsewhere", "elsewhere"),
        ("a row of cups no closer than the cans", "the cans"),
        ("cups: circle; cans: spiral", "spiral"),
        ("a circle of cups, except when red", "except"),
        ("cups in a row, red blue yellow white", "yellow"),
        ("put the cups in a circle, twice as big as before", "twice"),
        ("stack the cups but never the red one", "must not"),
        ("put a cup in each corner", "corner"),
        ("arrange the cups in a circle, one of the cans beside the glorp", "glorp"),
    ],
)
def test_a_wish_that_is_not_understood_is_refused(interpreter, text, words):  # noqa: F811
    found = interpreter.interpret(text, SCENES["cans and cups"])
    assert found.status == "refused" and not found.goal.parts and words in found.message


@pytest.mark.parametrize(
    ("text", "slot", "options"),
    [
        ("put the cups in a line but not on the left", "x_position", ("center", "right")),
        ("stack the cups, not in the middle", "y_position", ("top", "bottom")),
    ],
)
def test_where_only_the_wrong_place_is_said_the_right_one_is_asked_for(interpreter, text, slot, options):  # noqa: F811
    found = interpreter.interpret(text, SCENES["cans and cups"])
    assert found.status == "ask" and found.question.slot == slot and set(found.question.options) == set(options)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("put the cups in a circle on the left, not on the right", {"shape": "circle", "x_position": "left"}),
        ("put everything in a circle, not the cans", {"shape": "circle", "objects": [3, 4, 5, 6]}),
        ("please stack the cups, my best friend arrives first thing", {"shape": "tower", "objects": [3, 4, 5, 6]}),
        ("put the cups in a circle with the open bit on its right side", {"shape": "circle", "rotation": "east"}),
        ("put the cups in a row, close to your own base", {"shape": "line", "y_position": "bottom"}),
        ("cups in a row, a long one", {"shape": "line", "size": "large"}),
    ],
)
def test_a_plain_structure_is_still_built(interpreter, text, values):  # noqa: F811
    found = interpreter.interpret(text, SCENES["cans and cups"])
    assert found.status == "ok" and len(found.goal.parts) == 1
    assert found.goal.parts[0].to_dict().items() >= values.items()


def test_a_size_that_a_shape_cannot_have_is_said(interpreter):  # noqa: F811
    found = interpreter.interpret("build a pyramid from the blocks, nice and big", SCENES["blocks"])
    assert found.status == "ok" and "a pyramid has no size" in found.message


def test_one_object_cannot_stand_on_two(interpreter):  # noqa: F811
    found = interpreter.interpret("put the cup on the plate and on the bowl but not on the plate", SCENES["dinner"])
    assert found.status == "refused" and "contradicts itself" in found.message


def test_its_keeps_its_owner(interpreter):  # noqa: F811
    found = interpreter.interpret("put the plate in the middle, fork to its left, knife to its right", SCENES["dinner"])
    assert [part.reference for part in found.goal.parts[1:]] == [(0,), (0,)]


def test_what_is_circled_stays_part_of_the_circle(interpreter):  # noqa: F811
    found = interpreter.interpret("circle the blue cups around the bowl", SCENES["party"]).goal.parts[0]
    assert (found.objects, found.around) == ((3, 4, 5), (6,))


@pytest.mark.parametrize(
    "text",
    [
        "put the cups in a circle without moving the red one",
        "line up the cups but keep the red one where it is",
        "leave the red cup alone and line up the cups",
    ],
)
def test_what_should_stay_is_in_no_structure(interpreter, text):  # noqa: F811
    found = interpreter.interpret(text, SCENES["cans and cups"])
    assert found.status == "ok" and found.goal.parts[0].objects == (4, 5, 6)


@pytest.mark.parametrize(
    "text", ["stack all but two of the cups", "leave the cans where they are and line up the cans"]
)
def test_unclear_and_impossible_exceptions_are_refused(interpreter, text):  # noqa: F811
    assert interpreter.interpret(text, SCENES["cans and cups"]).status == "refused"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("one cup per can", "one cup per"), ("put a can between every two cups", "between every two"),
        ("put the cans in a row under the table", "under the table"), ("put the cans on the floor", "on the floor"),
        ("stack the cans but leave them leaning", "leaning"), ("put half of the cups on the left", "half of the"),
        ("put the cups in a circle half as big", "half as big"), ("glorp on the left, white cup on the right", "glorp"),
    ],
)  # fmt: skip
def test_what_no_goal_can_hold_is_refused_by_name(interpreter, text, words):  # noqa: F811
    found = interpreter.interpret(text, SCENES["cans and cups"])
    assert found.status == "refused" and words in found.message


def test_an_edge_without_a_side_is_asked_for(interpreter):  # noqa: F811
    found = interpreter.interpret("circle of cups close to the edge of the table", SCENES["cans and cups"])
    assert found.status == "ask" and "which edge" in found.message


def test_numbers_of_objects_count_the_one_without_a_number(interpreter):  # noqa: F811
    found = interpreter.interpret("put cups 1 and 3 on the left", SCENES["cans and cups"])
    assert found.goal.parts[0].objects == (3, 5)


@pytest.mark.parametrize(
    ("text", "scene", "words"),
    [
        ("stack the two balls", "toys", "nothing stands on a ball"), ("put the car on the red ball", "toys", "nothing stands on a ball"),
        ("the knife comes after the fork, going left to right in a row", "dinner", "after"),
        ("Where the blue mug is now, I'd like the red one, and the other way round.", "breakfast", "Where"),
        ("put the plate on the right, I mean my other right", "breakfast", "other right"),
    ],
)  # fmt: skip
def test_what_objects_cannot_do_and_relations_that_are_not_known(interpreter, text, scene, words):  # noqa: F811
    found = interpreter.interpret(text, SCENES[scene])
    assert found.status == "refused" and words in found.message


def test_a_choice_between_objects_is_asked_for(interpreter):  # noqa: F811
    found = interpreter.interpret("put either the hammer or the drill on the left", SCENES["workshop"])
    assert found.status == "ask" and found.question.options == ("hammer", "drill")
    left = interpreter.interpret("put the box on the left without touching the hammer or the drill", SCENES["workshop"])
    assert left.status == "ok" and left.goal.parts[0].objects == (5,)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("line up the cups from the front left corner to the back right corner", "to the back right corner"),
        ("put the cups in a row 10 cm from the back edge", "10 cm from the back edge"),
        ("put the red can two inches from the left edge", "two inches from the left edge"),
    ],
)
def test_diagonals_and_distances_from_an_edge_are_refused_by_both_readers(parser, encoder, text, words):
    network = Interpreter(lambda: parser, encoder=encoder, network=lambda: NetworkWriter.from_pretrained(encoder))
    found = network.interpret(text, SCENES["cans and cups"])
    assert found.status == "refused" and words in found.message


def test_a_piece_of_a_table_setting_has_no_place_of_its_own(interpreter):  # noqa: F811
    found = interpreter.interpret("set the table but put the fork on the right", SCENES["dinner"])
    assert found.status == "refused" and "the place of the fork in a table setting" in found.message
