"""Which objects an instruction means."""

import pytest

from grounding.selection import SelectionError, select_objects

KITCHEN = ["cup", "mug", "can", "can", "can", "bowl", "plate", "fork", "knife", "spoon", "box", "cup"]
ALL = tuple(range(len(KITCHEN)))


@pytest.mark.parametrize(
    ("text", "indices"),
    [
        ("put the cups in a small circle on the left", (0, 11)),
        ("stack the three cans", (2, 3, 4)),
        ("stack two cans", (2, 3)),
        ("2 red soup cans in a row", (2, 3)),
        ("a tower of tins", (2, 3, 4)),
        ("the glasses in a line", (0, 11)),
        ("the dishes far apart", (5, 6)),
        ("the silverware in a row", (7, 8, 9)),
        ("put the plate on the left", (6,)),
        ("stack the tuna can, the soup can and the cracker box", (2, 3, 10)),
        ("every can in a row", (2, 3, 4)),
        ("CANS in a CIRCLE", (2, 3, 4)),
        # nothing named
        ("build a small circle on the left", ALL),
        ("set the table at the right", ALL),
        ("make a table setting with all of them", ALL),
        ("arrange everything in a line, a bit to the left", ALL),
        # left out
        ("everything but the bowl in a line", tuple(i for i in ALL if i != 5)),
        ("line up everything except for the cutlery and the cups", (1, 2, 3, 4, 5, 6, 10)),
        ("all the cups, but not the mug", (0, 11)),
        ("stack the cans without touching the bowl", (2, 3, 4)),
        ("the cups not too tight in a circle", (0, 11)),
        # "can" that asks
        ("can you line up the cups as close as you can", (0, 11)),
        ("Can the cups form a ring?", (0, 11)),
        # a word that only describes
        ("put the orange cups in a row", (0, 11)),
    ],
)
def test_the_meant_objects(text, indices):
    assert select_objects(text, KITCHEN).indices == indices


def test_cups_are_mugs_only_where_there_is_no_cup():
    assert select_objects("the cups", ["mug", "box", "mug"]).indices == (0, 2)
    assert select_objects("the cups", ["mug", "cup"]).indices == (1,)
    with pytest.raises(SelectionError):
        select_objects("the mugs", ["cup"])


def test_the_selection_says_which_nouns_chose():
    selection = select_objects("the knives and the boxes, but not the spoons", KITCHEN)
    assert selection.named == ("knife", "box")
    assert selection.excluded == ("spoon",)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("put the bananas in a line", "names 'banana'; there is only: 2 x cup, mug, 3 x can"),
        ("stack four cans", "names 4 of 'can'"),
        ("stack the cans and the hammer", "names 'hammer'"),
    ],
)
def test_what_is_not_there_is_said(text, message):
    with pytest.raises(SelectionError, match=message):
        select_objects(text, KITCHEN)


def test_leaving_out_everything_leaves_nothing():
    with pytest.raises(SelectionError, match="leaves no object to move; there is: 2 x bowl"):
        select_objects("everything but the bowls", ["bowl", "bowl"])


def test_no_objects_at_all():
    with pytest.raises(SelectionError, match="nothing"):
        select_objects("make a circle", [])


def test_unrecognised_objects_can_be_what_any_noun_means():
    assert select_objects("the cups in a row", ["object", "object"]).indices == (0, 1)
    assert select_objects("the cups in a row", ["object", "cup"]).indices == (1,)


def test_a_category_that_no_list_knows_is_a_noun_too():
    assert select_objects("line up the gizmos", ["gizmo", "cup", "brass gizmo"]).indices == (0, 2)
