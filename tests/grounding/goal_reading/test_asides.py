"""What carries no wish is passed over by its structure, and what could be a wish never is."""

from __future__ import annotations

import pytest

from grounding.goal_reading.asides import Asides
from grounding.goal_reading.reader import GoalReader
from grounding.goal_reading.tokens import split
from grounding.references.attributes import ObjectAttributes, SceneObject
from grounding.references.object_names import vocabulary

SCENE = [
    SceneObject("mug", ObjectAttributes(("red",), (0.12, 0.09, 0.1), (0.3, 0.3))),
    SceneObject("bowl", ObjectAttributes(("white",), (0.16, 0.16, 0.06), (0.5, 0.0))),
    SceneObject("spoon", ObjectAttributes(("grey",), (0.18, 0.04, 0.02), (0.4, -0.2))),
]
PLAIN = "put the spoon in the bowl"


def asides(text: str) -> Asides:
    return Asides(split(text), vocabulary([each.name for each in SCENE]))


@pytest.mark.parametrize(
    "text",
    [
        "because I am tired, ...", "since my back hurts, ...", "so that I can reach the bowl", "in order to save space, ...",
        "to impress my girlfriend, ...", "for my grandmother's birthday, ...", "if you have a minute, ...",
        "if it's not too much trouble, ...", "would you be so kind as to ...", "What a mess! ...", "My sister gave me this bowl. ...",
        "Robbie, put", "hey Jarvis, put", "thank you for your help.", "so nobody knocks it over",
    ],
)  # fmt: skip
def test_asides_end_where_their_clause_ends(text):
    found = asides(text)
    words = found.said.words
    ends = {",", ".", "!", "", "put"}
    end = found.at(0)
    assert end is not None and ((words[end] if end < len(words) else "") in ends)


@pytest.mark.parametrize(
    "aside",
    [
        "because I want it upside down", "so that the handle is on the left", "to cover the mug", "for ten minutes", "for each mug",
        "since the mug should be in the corner", "if the mug is full", "so nobody sees the mug", "because they must not touch",
        "for symmetry", "to make it fall",
    ],
)  # fmt: skip
def test_what_could_be_a_wish_is_no_aside(aside):
    assert asides(aside).at(0) is None


@pytest.mark.parametrize(
    "text",
    [
        "Put the spoon in the bowl because I'm left-handed.", "Since my back hurts, could you put the spoon in the bowl?",
        "Robbie, put the spoon in the bowl", "put the spoon in the bowl for my little brother's party", "Wow, what a mess! Spoon in the bowl.",
        "put the spoon in the bowl so my husband can find it", "The mug is from my aunt. Put the spoon in the bowl.",
        "put the spoon in the bowl, which I got in Rome", "put the spoon (a present from my boss) in the bowl",
    ],
)  # fmt: skip
def test_an_aside_changes_nothing(text):
    reader = GoalReader()
    plain = reader.read(PLAIN, SCENE)
    assert plain.complete
    assert reader.read(text, SCENE).goal == plain.goal


@pytest.mark.parametrize(
    "more",
    [
        ", upside down", ", Diagonally", " but upside down", " twice", ", with the handle inward", ", tilted", " for ten seconds",
        " if it is clean", " so that it faces me", " and peel it", ", my sister wants it peeled", " (handle up)", " unless it is dirty",
    ],
)  # fmt: skip
def test_no_wish_is_dropped(more):
    assert not GoalReader().read(PLAIN + more, SCENE).complete


def test_a_request_after_an_aside_is_read():
    reading = GoalReader().read("put the spoon in the bowl because I am tired and put the mug behind the bowl", SCENE)
    assert [part.relation for part in reading.goal.parts] == ["in", "behind"]


def test_it_can_be_what_a_comment_names():
    reading = GoalReader().read("My sister gave me this bowl. Put the spoon in it.", SCENE)
    assert reading.goal == GoalReader().read(PLAIN, SCENE).goal
