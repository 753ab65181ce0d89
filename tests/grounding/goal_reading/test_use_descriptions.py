"""Objects that are described by their use, in a scene."""

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_reading.scene_references import ReadingQuestion, SceneReferences
from grounding.goal_reading.use_descriptions import described_objects


def described(encoder, scene, text):
    find = SceneReferences(goal_scenes()[scene], encoder, False, False)
    return described_objects(text, find), find.notes


def test_the_choice_is_said(encoder):
    assert described(encoder, "toys", "the thing that quacks") == ([5], ["'the thing that quacks' is taken for the duck"])


def test_all_of_a_kind_or_as_many_as_are_said(encoder):
    assert described(encoder, "office", "things with ink")[0] == [3, 4]
    assert described(encoder, "office", "the two things with ink")[0] == [3, 4]
    assert described(encoder, "office", "the three things with ink")[0] is None


def test_a_colour_chooses_among_them(encoder):
    assert described(encoder, "office", "the blue thing with ink")[0] == [3]


def test_one_of_several_is_a_question(encoder):
    with pytest.raises(ReadingQuestion, match="can be each of 2 objects"):
        described(encoder, "office", "the thing with ink")


def test_without_an_encoder_nothing_is_compared():
    assert described(None, "toys", "the thing that quacks") == (None, [])
