"""What copied phrases mean by kinds, uses and contents, and by places that contrast with each other."""

import pytest

from grounding.resolve.phrase import PhraseGroup


@pytest.mark.parametrize(
    ("scene", "phrase", "found"),
    [
        ("kitchen", "anything that pours", [0, 2, 3]),
        ("kitchen", "the three with spouts", [0, 2, 3]),
        ("dinner", "what stabs", [1]),
        ("grocery", "everything that grows on a tree", [4, 5, 6]),
        ("fruit and plate", "everything edible", [1, 2, 3]),
        ("desk", "the roll", [5]),
        ("office", "coloured things", [2, 3, 4, 5]),
        ("grocery", "the fish tin", [3]),
        ("grocery", "the thing made of fish", [3]),
        ("garden", "shovel", [3]),
        ("bathroom", "toiletries", [0, 1, 2, 3, 4, 5]),
        ("bathroom", "the toothpaste", [5]),
        ("workshop", "the thing that holds work still", [4]),
        ("desk", "the nearest object on the right", [0]),
        ("party", "the red cup right in front of me", [1]),
        ("desk", "whatever is nearest to the mug", [5]),
        ("tall and short", "whatever stands nearest the tin", [2]),
        ("office", "the thing one writes in", [5]),
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
        ("fruit and plate", "the lemon"),  # there is none, and the banana is only of its colour
        ("fruit and plate", "the apple that is"),  # nothing says what it is
        ("kitchen", "the carton with the milk"),
    ],
)
def test_what_is_not_certain_is_not_chosen(meant, scene, phrase):
    assert isinstance(meant(scene, phrase)[0], Exception)


@pytest.mark.parametrize(
    ("scene", "phrase"),
    [
        ("blocks", "the back row of blocks"),
        ("blocks", "the left-hand column"),
        ("blocks", "the two leftmost of the front row"),
        ("grocery", "the box w/ the corn flakes"),
        ("toys", "the ball that's the same colour as the far right block"),
        ("lab", "the one with the brown glass"),
        ("blocks", "the odd one out"),
        ("blocks", "the odd ones"),
        ("blocks", "the block without a twin"),
        ("blocks", "the block there's only one of"),
        ("blocks", "all blocks that have a twin"),
        ("blocks", "the eight paired blocks"),
        ("shapes", "the two cubes of the same size"),
        ("tea party", "the white pair"),
        ("blocks", "the warm colours"),
        ("blocks", "the warm ones"),
        ("blocks", "the block in the very centre"),  # of the blocks, or of the table
        ("breakfast", "all non-edible things"),
        ("breakfast", "the non-mugs"),
        ("cans and cups", "its twin"),
        ("blocks", "such as aren't"),
        ("fruit and plate", "anything you can't"),
        ("fruit and plate", "the two that are not"),
    ],
)
def test_what_is_not_understood_chooses_nothing(meant, scene, phrase):
    assert isinstance(meant(scene, phrase)[0], Exception)
