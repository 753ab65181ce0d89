"""The objects that copied phrases of a goal mean, in scenes of this module."""

import time

import pytest

from grounding.resolve.attributes import ObjectAttributes, SceneObject
from grounding.resolve.errors import Doubt, ResolveError
from grounding.resolve.goal_phrases import GoalPhrases
from grounding.resolve.phrase import PhraseGroup
from grounding.resolve.referents import Referents


def thing(name, colour, size, position):
    return SceneObject(name, ObjectAttributes((colour,), size, position))


MUG, TIN, PEN = (0.12, 0.09, 0.1), (0.07, 0.07, 0.11), (0.14, 0.01, 0.01)
SHELF = (  # 0, 1: tins; 2 to 4: mugs; 5 teapot; 6 pencil; 7 pear
    thing("can", "red", (0.07, 0.07, 0.06), (0.25, 0.25)),
    thing("can 2", "blue", TIN, (0.3, 0.0)),
    thing("mug", "red", MUG, (0.45, 0.3)),
    thing("mug 2", "white", MUG, (0.45, -0.02)),
    thing("mug 3", "green", MUG, (0.62, -0.3)),
    thing("teapot", "white", (0.2, 0.14, 0.15), (0.65, 0.02)),
    thing("pencil", "yellow", PEN, (0.62, 0.28)),
    thing("pear", "green", (0.07, 0.07, 0.1), (0.26, -0.3)),
)
CUBES = tuple(  # 0, 1 red; 2, 3 blue; 4, 5 green; 6 orange
    thing(f"cube {n + 1}", colour, (0.05, 0.05, 0.05), (0.3 + 0.15 * (n // 3), 0.3 - 0.3 * (n % 3)))
    for n, colour in enumerate(("red", "red", "blue", "blue", "green", "green", "orange"))
)


def resolve(objects, *groups, text=""):
    return GoalPhrases(Referents(objects), text).resolve(groups)


def one(objects, *phrases, role="objects", shaped=False, text=""):
    return resolve(objects, PhraseGroup(phrases, role, shaped), text=text)[0]


@pytest.mark.parametrize(
    ("phrase", "found"),
    [
        ("the mug on my left", [2]),
        ("the taller of the two tins", [1]),
        ("the mug that's furthest from me", [4]),
        ("the second tallest thing", [1]),
        ("the left two of the three mugs", [2, 3]),
        ("all mugs bar the green one", [2, 3]),
        ("everything that is neither green nor white", [0, 1, 2, 6]),
        ("those of the mugs that aren't white", [2, 4]),
        ("the thing one writes with", [6]),
        ("whatever you pour tea with", [5]),
        ("top of the blue tin", [1]),
        ("the pot", [5]),
        ("mug (red)", [2]),
        ("mugs that are red or green", [2, 4]),
        ("the crimson mug", [2]),
        ("the thing between the blue tin and the teapot", [3]),
        ("everything shorter than seven centimetres", [0, 6]),
        ("both tins", [0, 1]),
        ("what's edible", [7]),
        ("the wee red tin", [0]),
        ("whichever mug is the rearmost", [4]),
        ("the non-green mugs", [2, 3]),
        ("non-red, non-white mugs", [4]),
        ("anything not a mug", [0, 1, 5, 6, 7]),
        ("the mug more near to me at the left", [2]),
        ("the thing most distant from me on the left", [6]),
        ("mug nearest me on the right", [4]),
        ("white mug right side one", [3]),
        ("the mug back on the right", [4]),
        ("the thing lowest", [6]),
        ("tin - the taller", [1]),
        ("the more small tin", [0]),
        ("the one taller than the others", [5]),
        ("the tallest tin of the two", [1]),
    ],
)
def test_a_phrase_means_its_objects(phrase, found):
    assert sorted(one(SHELF, phrase)) == found


@pytest.mark.parametrize(
    "phrase",
    [
        "the red one", "the mug", "the white thing", "the tin", "the mug that isn't green", "the medium mug",
        "the tallest mug of the two", "the medium thing",
    ],
)  # fmt: skip
def test_a_doubt_stays_a_question(phrase):
    with pytest.raises((Doubt, ResolveError)):
        raise one(SHELF, phrase)


@pytest.mark.parametrize("phrase", ["the wooden things", "everything grandma gave me", "the sofas"])
def test_what_is_not_known_is_not_passed_over(phrase):
    assert isinstance(one(SHELF, phrase), ResolveError)


def test_bare_colours_take_the_noun_that_follows_in_the_list():
    assert one(CUBES, "the red", "blue", "green cubes", role="structure", shaped=True) == [0, 1, 2, 3, 4, 5]
    assert one(SHELF, "the red", "the green mug", role="structure", shaped=True) == [2, 4]


def test_a_colour_alone_means_all_of_it_in_a_structure_and_one_beside_it():
    assert one(CUBES, "blue", role="structure", shaped=True) == [2, 3]
    assert isinstance(one(CUBES, "blue", role="reference"), Doubt)
    assert one(CUBES, "orange", role="reference") == [6]


def test_bare_colours_are_of_the_kind_that_has_them_all():
    assert one(SHELF, "red", "white", "green", role="structure", shaped=True) == [2, 3, 4]


def test_a_tower_is_not_made_of_one_object():
    assert one(SHELF, "the tin", role="structure", shaped=True) == [0, 1]


def test_the_noun_before_a_phrase_is_meant_by_one():
    assert one(SHELF, "the red one", text="swap the two tins, no, only lift the red one") == [0]
    assert one(CUBES, "the left one", text="of the green cubes take the left one") == [4]


def test_the_others_are_those_that_no_other_phrase_names():
    groups = PhraseGroup(("the green mug",), "objects"), PhraseGroup(("the other mugs",), "structure", True)
    assert resolve(SHELF, *groups) == [[4], [2, 3]]
    groups = PhraseGroup(("the tins",), "structure", True), PhraseGroup(("the rest",), "structure", True)
    assert resolve(SHELF, *groups)[1] is None


def test_what_another_part_moves_is_left_out_of_a_plain_plural():
    groups = PhraseGroup(("the mugs",), "structure", True), PhraseGroup(("the white mug",), "around")
    assert resolve(SHELF, *groups) == [[2, 4], [3]]
    groups = PhraseGroup(("the mugs",), "structure", True), PhraseGroup(("the white mug",), "kept")
    assert resolve(SHELF, *groups)[0] == [2, 3, 4]


@pytest.mark.parametrize("phrase", ["the whole lot", "all of these things", "everything on the table", "all eight"])
def test_everything_is_everything(phrase):
    found = one(SHELF, phrase, role="structure", shaped=True)
    assert found is None or found == list(range(8))


def test_them_means_what_was_named_before():
    groups = PhraseGroup(("the tins",), "structure", True), PhraseGroup(("them",), "reference")
    assert resolve(SHELF, *groups)[1] == resolve(SHELF, *groups)[0]


def test_a_long_phrase_is_read_in_short_time():
    begun = time.process_time()
    for phrase in ("the mug next to " * 40 + "the pear", "what is red or " * 60 + "blue", "all but " * 80, "( " * 200):
        one(SHELF, phrase)
    assert time.process_time() - begun < 5


def test_a_demonstrative_points_at_what_was_named_last():
    groups = PhraseGroup(("the mug between the blue tin and the teapot",)), PhraseGroup(("that mug",), "reference")
    text = "push the mug between the blue tin and the teapot, and put that mug down"
    assert resolve(SHELF, *groups, text=text)[1] == [3]


def test_a_number_of_them_is_everything_only_where_it_fits():
    assert one(SHELF, "all eight of them", role="structure", shaped=True) is None
    assert isinstance(one(SHELF, "all four of them", role="structure", shaped=True), Doubt)


def test_a_denial_ends_at_but():
    assert one(SHELF, "the mug that is neither red nor white but is at the back") == [4]


def test_a_place_alone_takes_the_noun_before_it():
    text = "Of the mugs, the nearest to the left edge goes first."
    assert one(SHELF, "the nearest to the left edge", text=text) == [2]


def test_the_medium_one_is_that_between_two_other_sizes():
    pots = [
        thing("pot", "brown", (0.15, 0.15, 0.14), (0.35, 0.2)),
        thing("pot 2", "brown", (0.1, 0.1, 0.09), (0.3, -0.3)),
        thing("pot 3", "green", (0.12, 0.12, 0.11), (0.5, -0.2)),
    ]
    assert one(pots, "the medium pot") == one(pots, "the middle-sized one") == [2]
    assert isinstance(one(pots[:2], "the medium pot"), ResolveError)
