"""A line may have what an instruction asks for and nothing else, and names objects by noun phrases."""

import pytest

from grounding.goal_reading.corrections import without_corrections
from grounding.goal_reading.reader import GoalReader
from grounding.llm_goals.checks import mismatch
from grounding.llm_goals.limits import limited
from grounding.llm_goals.lines import Said, goal_line, parts_of, pieces_of
from grounding.references.phrases import Vocabulary
from grounding.references.word_forms import FORMS


def chunks_of(text):
    return without_corrections(GoalReader().chunks(text, Vocabulary(FORMS)))


def said(text, lengths=()):
    return limited(Said.of(text, lengths), chunks_of(text))


@pytest.mark.parametrize(
    ("text", "unasked", "asked"),
    [
        ("I need a row of cups along the left edge", (", left", ", along right", " tower of"), ", along left"),
        ("put the cups in a small circle", (", large", ", left", " line of", " swap of"), ", small"),
        ("put the bowl behind the cup", (", left of", ", on", " move of", " circle of"), ", behind"),
        ("stack the can on the jar", (", in front of", " line of", ", order height"), ", on"),
        ("swap the fork and the spoon", (" move of", ", next to"), " swap of"),
        ("arrange the six cups in two rows of three", (", rows 3", ", columns 2"), ", columns 3"),
        ("sort the blocks by colour", (", group kind", ", order height"), ", group colour"),
    ],
)
def test_what_nobody_asks_for_is_no_choice_and_what_is_said_is_one(text, unasked, asked):
    found = said(text)
    assert set(unasked) <= found.unasked and asked not in found.unasked


def test_the_way_of_a_move_and_the_sides_of_a_place_can_be_said():
    found = said("slide the bowl 5 cm to the right")
    assert not {", right", " move of"} & found.unasked and {", left", ", away"} & found.unasked == {", left"}
    found = said("put the bowl on the left and line up the cans")
    assert not {", left", ", left of", " line of"} & found.unasked
    assert {", right", ", top", ", along left"} <= found.unasked


def test_objects_are_named_by_noun_phrases_only():
    found = said("stack the can on the jar")
    assert [word for place, word in enumerate(found.words) if found.names(place)] == ["the", "can", "the", "jar"]
    assert pieces_of(" place of the can, on the jar.", found)
    with pytest.raises(ValueError, match="not legal"):
        pieces_of(" tower of the can on the jar.", found)
    exception = said("put everything except the bowl in a ring")
    assert parts_of(" circle of everything except the bowl.", exception)[0]["objects"] == ["everything except the bowl"]


def test_a_word_that_nobody_knows_leaves_the_line_free():
    text = "put the bowl zorp behind the cup"
    assert said(text) == Said.of(text)


def test_without_a_noun_phrase_everything_can_be_meant():
    found = said("in a circle, and swap")
    legal = next(goal_line(found))
    assert " circle of" in legal and found.naming == ()


def test_a_right_line_passes_its_own_limits():
    text = "stack the cans on the left and put the bowl 5 cm behind the red cup"
    line = " tower of the cans, left; place of the bowl, behind the red cup, distance 5 cm."
    found = said(text, ("5 cm",))
    pieces = pieces_of(line, found)
    assert not found.unasked.intersection(pieces)


def test_adjectives_that_share_a_noun_may_stand_in_several_phrases_of_a_part():
    text = "make a cross out of the red, blue and orange blocks"
    cross = {"kind": "structure", "shape": "cross", "objects": ["the red", "blue", "orange blocks"]}
    assert not mismatch(chunks_of(text), [cross])
    assert "leaves out" in mismatch(chunks_of(text), [cross | {"objects": ["the red", "orange blocks"]}])
    apart = [cross | {"objects": ["the red"]}, cross | {"objects": ["blue", "orange blocks"]}]
    assert "leaves out" in mismatch(chunks_of(text), apart)
