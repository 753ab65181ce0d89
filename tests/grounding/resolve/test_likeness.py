"""What copied phrases mean by what objects have in common: the odd one, twins, equal sizes, warm colours."""

import pytest


@pytest.mark.parametrize(
    ("scene", "phrase", "found"),
    [
        ("blocks", "the odd one out", [8]),
        ("blocks", "the single one of its colour", [8]),
        ("blocks", "the block without a twin", [8]),
        ("blocks", "the block there's only one of", [8]),
        ("blocks", "all blocks that have a twin", [0, 1, 2, 3, 4, 5, 6, 7]),
        ("blocks", "the block with the unique colour", [8]),
        ("blocks", "the eight paired blocks", [0, 1, 2, 3, 4, 5, 6, 7]),
        ("tea party", "the white pair", [1, 2]),
        ("tall and short", "the tall pair", [0, 4]),
        ("shapes", "the two cubes of the same size", [0, 1]),
        ("breakfast", "the two vessels of equal height", [0, 1]),
        ("breakfast", "the coloured things", [0, 1, 5]),
        ("office", "coloured things", [2, 3, 4, 5]),
        ("blocks", "the warm colours", [0, 1, 6, 7, 8]),
    ],
)
def test_objects_are_chosen_by_their_likeness(meant, scene, phrase, found):
    assert meant(scene, phrase) == [found]


@pytest.mark.parametrize(
    ("scene", "phrase"),
    [
        ("toys", "the odd one out"),  # the car or the duck
        ("shapes", "the odd cube"),
        ("cans and cups", "the two cups of the same size"),  # all four are
        ("party", "the identical pair"),
        ("blocks", "the warm ones"),  # nothing speaks of colours
        ("bathroom", "the warm colours"),  # is pink one?
        ("blocks", "the block in the very centre"),  # of the blocks, or of the table
    ],
)
def test_what_is_not_certain_is_not_chosen(meant, scene, phrase):
    assert isinstance(meant(scene, phrase)[0], Exception)


def test_the_odd_one_is_of_the_noun_before_it(meant):
    assert meant("tea party", "Both white cups are kept, the odd one stands between them.", "the odd one") == [[3]]
