"""Nouns from a picture choose objects only where it is said, and only where no other object may be meant."""

import numpy as np
import pytest
from PIL import Image

from agent.perception.segments import Segment
from agent.scenes.recorded_nouns import chosen_by_noun, doubts, how_to_name, taken_nouns
from grounding.references.selection import Selection


def segment(number: int, noun: str = "", **nouns: float) -> Segment:
    name = f"object {number}"
    display_name = f"{noun or 'object'} {number}"
    return Segment(name, display_name, np.zeros((1, 3)), None, np.eye(4), np.ones(3), noun=noun, nouns=nouns)


FOUND = (
    segment(1, "mug", mug=0.93, cup=0.95), segment(2, "bowl", bowl=0.9), segment(3, mug=0.41, cup=0.6), segment(4),
)  # fmt: skip


def test_what_is_taken_for_what_is_said_unless_the_user_said_it():
    assert taken_nouns(FOUND, {}) == ["object 1 is taken for a mug (0.93)", "object 2 is taken for a bowl (0.90)"]
    assert taken_nouns(FOUND, {"object 1": "can"}) == ["object 2 is taken for a bowl (0.90)"]


@pytest.mark.parametrize(
    ("noun", "chosen", "called", "unsure"),
    [
        ("mug", (0,), {}, ["object 3 may be a mug too (0.41)"]),
        ("red mug", (0,), {}, ["object 3 may be a mug too (0.41)"]),
        ("mug", (0,), {"object 3": "vase"}, []),  # the user's word goes before the picture's
        ("mug", (0, 2), {"object 3": "mug"}, []),
        ("bowl", (1,), {}, []),
        ("cup", (), {}, ["object 1 may be a cup too (0.95)", "object 3 may be a cup too (0.60)"]),
    ],
)
def test_objects_that_may_be_meant_too_are_asked_about(noun, chosen, called, unsure):
    assert doubts(FOUND, called, Selection(chosen, (noun,))) == unsure


def test_what_may_have_been_left_out_is_asked_about():
    left = Selection((1, 2, 3), (), ("mug",))
    assert chosen_by_noun(left) and not chosen_by_noun(Selection((0, 1))) and not chosen_by_noun(None)
    assert doubts((FOUND[1], FOUND[2]), {}, Selection((0,), (), ("mug",))) == ["object 3 may be a mug too (0.41)"]


def test_the_question_shows_the_picture_and_the_guesses():
    question = how_to_name(FOUND, "object 3", np.full((4, 6, 3), 80, np.uint8))
    assert "object 3 may be a mug (0.41)" in question
    assert question.endswith("--call 'object 3=cup' says what an object is")
    path = question.split("numbered in ")[1].split(";")[0]
    assert Image.open(path).size == (6, 4)
