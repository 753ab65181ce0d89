"""The network as second reader of whole instructions."""

from __future__ import annotations

import pytest

from grounding.goal_network.network_reading import NetworkReading
from grounding.goal_network.second_reader import SecondReader
from grounding.goal_network.writer import NetworkWriter
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.interpreter import Interpreter


@pytest.fixture(scope="module")
def interpreter(parser, encoder):
    return Interpreter(lambda: parser, encoder=encoder, network=lambda: NetworkWriter.from_pretrained(encoder))


THERE = ["can", "can", "cup", "cup", "cup", "bowl"]


def test_unknown_words_no_longer_refuse_a_clear_wish_and_are_quoted(interpreter):
    found = interpreter.interpret("wud ya kindly plonk the cups in a triangle, guv", THERE)
    assert (found.status, found.goal) == ("ok", Goal((StructurePart("triangle", objects=(2, 3, 4)),)))
    assert "read without knowing" in found.message and "'guv'" in found.message


@pytest.mark.parametrize(
    "text",
    [
        "put the cups in a row and turn them upside down",
        "put the cups in a row with their handles to me",
        "stack the cans and pour the water into the bowl",
        "if it rains, line up the cups",
        "is the bowl behind the cans?",
        "stack the plates",
        "put half of the cups in a row",
        "the weather is fine today",
    ],
)
def test_what_no_goal_can_hold_stays_unbuilt(interpreter, text):
    found = interpreter.interpret(text, THERE)
    assert found.status in ("refused", "ask") and not found.goal.parts


def test_across_the_table_sides_are_turned_once(parser, encoder):
    network = lambda: NetworkWriter.from_pretrained(encoder)  # noqa: E731
    here, across = (
        Interpreter(lambda: parser, viewpoint=side, encoder=encoder, network=network) for side in ("robot", "opposite")
    )
    text = "wud ya plonk the cups in a triangle on the left side, guv"
    assert here.interpret(text, THERE).goal.parts[0].x_position == "left"
    assert across.interpret(text, THERE).goal.parts[0].x_position == "right"


def test_the_network_is_loaded_at_the_first_doubt_only(parser, encoder):
    loaded = []

    def network():
        loaded.append(1)
        return NetworkWriter.from_pretrained(encoder)

    interpreter = Interpreter(lambda: parser, encoder=encoder, network=network)
    interpreter.interpret("put the cups in a circle")
    assert not loaded
    interpreter.interpret("put the cups in a triangle", THERE)
    interpreter.interpret("put the cups in a square", THERE)
    assert loaded == [1]


def test_no_words_are_no_goal(encoder):
    assert SecondReader(lambda: NetworkWriter.from_pretrained(encoder)).read("") == NetworkReading()


@pytest.mark.parametrize("text", ["gather everything edible on the left", "line up everything wooden"])
def test_an_adjective_that_chooses_is_not_passed_over(interpreter, text):
    found = interpreter.interpret(text, ["mug", "bowl", "plate", "banana", "apple", "can"])
    everything = found.goal.parts and found.goal.parts[0].objects in (None, tuple(range(6)))
    assert not everything
