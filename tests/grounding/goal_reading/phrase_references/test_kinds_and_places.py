"""What copied phrases mean by kinds, uses and contents, and by places that contrast with each other."""

import pytest

from grounding.goal_reading.phrase_references.phrase import PhraseGroup


@pytest.mark.parametrize(
    ("scene", "phrase", "found"),
    [
        ("kitchen", "anything that pours", [0, 2, 3]),
        ("kitchen", "the three with spouts", [0, 2, 3]),
        ("dinner", "what stabs", [1]),
        ("grocery", "everything that grows on a tree", [4, 5, 6]),
        ("fruit and plate", "everything edible", [1, 2, 3]),
        ("desk", "the roll", [5]),
        ("grocery", "the fish tin", [3]),
        ("grocery", "the thing made of fish", [3]),
        ("grocery", "the box w/ the corn flakes", [1]),
        ("grocery", "the carton with the milk in it", [0]),
        ("garden", "shovel", [3]),
        ("bathroom", "toiletries", [0, 1, 2, 3, 4, 5]),
        ("bathroom", "the toothpaste", [5]),
        ("lab", "opaque bottle", [0]),
        ("workshop", "the thing that holds work still", [4]),
        ("desk", "the nearest object on the right", [0]),
        ("party", "the red cup right in front of me", [1]),
        ("desk", "whatever is nearest to the mug", [5]),
    ],
)
def test_a_phrase_means_its_objects(meant, scene, phrase, found):
    assert meant(scene, phrase) == [found]


def test_the_one_on_the_left_is_of_the_kind_of_the_one_on_the_right(meant):
    text = "The white cup on the right goes on the green saucer and the one on the left goes on the white saucer."
    groups = [
        PhraseGroup((words,), role)
        for words, role in (
            ("The white cup on the right", "objects"), ("the green saucer", "reference"),
            ("the one on the left", "objects"), ("the white saucer", "reference"),
        )
    ]  # fmt: skip
    assert meant("tea party", text, *groups) == [[2], [5], [1], [4]]


@pytest.mark.parametrize(
    ("scene", "phrase"),
    [
        ("cans and cups", "the bigger red object"),  # the can is taller, the cup is wider
        ("garden", "its little sister"),
        ("kitchen", "the carton with the milk"),
    ],
)
def test_what_is_not_certain_is_not_chosen(meant, scene, phrase):
    assert isinstance(meant(scene, phrase)[0], Exception)
