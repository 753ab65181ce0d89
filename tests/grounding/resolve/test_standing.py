"""Where objects stand: in a direction from others, on a side of the table, nearest to something, between others."""

import pytest

from grounding.resolve.phrase import PhraseGroup

LEFT_MUG, RIGHT_MUG, BOWL, PLATE, SPOON, BANANA = range(6)


@pytest.mark.parametrize(
    ("phrase", "found"),
    [
        ("the mug left of the plate", [LEFT_MUG]),
        ("the mug to the left of the plate", [LEFT_MUG]),
        ("the mug on the left of the plate", [LEFT_MUG]),
        ("the mug on the left side of the plate", [LEFT_MUG]),
        ("the mug that is to the left of the plate", [LEFT_MUG]),
        ("the mug that's left of the plate", [LEFT_MUG]),
        ("the mug which stands to the right of the bowl", [RIGHT_MUG]),
        ("the mug on the right hand side of the bowl", [RIGHT_MUG]),
        ("the mug at the left of the bowl", [LEFT_MUG]),
        ("the mug in front of the plate", [RIGHT_MUG]),
        ("whatever is in front of the plate", [RIGHT_MUG]),
        ("the one in front of the plate", [RIGHT_MUG]),
        ("the mug in front", [LEFT_MUG]),
        ("the mug at the front of the table", [LEFT_MUG]),
        ("the mug beside the plate", [RIGHT_MUG]),
        ("the thing between the two mugs", [SPOON]),
        ("the mug closest to my edge of the table", [LEFT_MUG]),
        ("the mug the furthest from me", [RIGHT_MUG]),
        ("the mug lying at the near right", [RIGHT_MUG]),
        ("the mug standing at the left", [LEFT_MUG]),
        ("the second mug from the left", [RIGHT_MUG]),
        ("the third thing from the right", [SPOON]),
        ("things to the left of the spoon", [LEFT_MUG, BOWL, BANANA]),
        ("everything left of the bowl", [LEFT_MUG, BANANA]),
        ("all that stands behind the mugs", [BOWL, PLATE, SPOON, BANANA]),
        ("the left of the two mugs", [LEFT_MUG]),
        ("the mug on the left of the table", [LEFT_MUG]),
    ],
)
def test_where_objects_stand(meant, phrase, found):
    assert meant("breakfast", phrase) == [found]


@pytest.mark.parametrize(
    ("scene", "phrase", "found"),
    [
        ("blocks", "all those left of centre", [2, 5, 8]),
        ("cans and cups", "the can in front of the green one", [0]),
        ("garden", "what lies between the left pot and the green pot", [5]),
        ("cans and cups", "any two cups", [3, 4]),
        ("breakfast", "any mug", [0]),
        ("desk", "everything left of the tape", [1, 2, 3]),
        ("grocery", "the fruit behind the orange", [6]),
        ("dinner", "what you'd eat soup with", [3]),
        ("party", "half of the cups", [0, 1, 2]),
    ],
)
def test_one_of_several_scenes(meant, scene, phrase, found):
    assert meant(scene, phrase) == [found]


def test_what_nothing_stands_between_is_no_object(meant):
    assert isinstance(meant("breakfast", "the plate between the mugs")[0], Exception)


def test_what_is_left_out_is_not_counted(meant):
    groups = (PhraseGroup(("three cups",), "structure", True, 0), PhraseGroup(("yellow",), "kept"))
    assert meant("cans and cups", "a ring of three cups, none of them yellow", *groups)[0] == [3, 5, 6]


@pytest.mark.parametrize("phrase", ["bleu cups", "half of the red cups"])
def test_a_mistyped_colour_and_an_uneven_half_choose_nothing(meant, phrase):
    assert isinstance(meant("party", phrase)[0], Exception)
