"""Words of an instruction are looked up in the scene before its goal is written."""

from __future__ import annotations

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.word_presence import (
    COLOUR_ABSENT,
    COLOUR_HERE,
    GENERAL_NOUN,
    NO_NAME,
    NOUN_ABSENT,
    NOUN_HERE,
    UNKNOWN,
    word_presence,
)
from grounding.resolve.tokens import words_of


def presences(scene, text):
    words = words_of(text)
    return dict(zip(words, word_presence(words, goal_scenes()[scene]), strict=True))


def test_nouns_here_are_told_from_others():
    found = presences("grocery", "the lamp is broken, so stack the tins beside the fruit and no mugs")
    assert found["tins"] == found["fruit"] == NOUN_HERE
    assert found["mugs"] == NOUN_ABSENT
    assert found["broken"] == found["stack"] == NO_NAME


def test_colours_are_looked_up_in_the_plural_too():
    found = presences("party", "reds and blue ones, but nothing green or crimson")
    assert found["reds"] == found["blue"] == found["crimson"] == COLOUR_HERE
    assert found["green"] == COLOUR_ABSENT


def test_orange_is_a_fruit_where_there_is_one():
    assert presences("grocery", "the orange")["orange"] == NOUN_HERE
    assert presences("desk", "the orange")["orange"] == COLOUR_HERE


def test_general_nouns_name_nothing():
    assert presences("desk", "all the things")["things"] == GENERAL_NOUN


def test_without_a_scene_nothing_is_known():
    assert word_presence(["the", "cans"], None) == (UNKNOWN, UNKNOWN)
