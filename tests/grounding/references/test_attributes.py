"""Colours and sizes by which an instruction tells objects apart."""

import pytest

from grounding.references.attributes import ObjectAttributes, SceneObject, by_size, of_color, of_size
from grounding.references.selection import AmbiguousReferenceError, SelectionError, select_objects


def thing(name, color="", length=0.08, width=0.08, height=0.08):
    return SceneObject(name, ObjectAttributes((color,) if color else (), (length, width, height)))


CUPS = [
    thing("cup 1", "red", 0.06, 0.06, 0.06),
    thing("cup 2", "green", 0.06, 0.06, 0.061),
    thing("cup 3", "green", 0.10, 0.10, 0.10),
    thing("can 1", "blue", 0.07, 0.07, 0.11),
    thing("can 2", "red", 0.07, 0.07, 0.14),
    thing("bowl", "red", 0.16, 0.16, 0.055),
    thing("box", "brown", 0.20, 0.08, 0.04),
]
ALL = tuple(range(len(CUPS)))


@pytest.mark.parametrize(
    ("text", "indices"),
    [
        ("put the green cups in a line", (1, 2)),
        ("put the red things in a line", (0, 4, 5)),
        ("line up everything red", (0, 4, 5)),
        ("the crimson objects in a circle", (0, 4, 5)),
        ("everything but the red ones in a line", (1, 2, 3, 6)),
        ("put the small cups in a row", (0, 1)),
        ("put the little green cup and the bowl in a row", (1, 5)),
        ("stack the big cup and the bowl", (2, 5)),
        ("the tallest can and the bowl in a line", (4, 5)),
        ("put the two tallest objects in a line", (3, 4)),
        ("put the tallest three objects in a circle", (2, 3, 4)),
        ("put the taller can and the box in a line", (4, 6)),
        ("the second tallest can and the bowl", (3, 5)),
        ("the widest object and the longest object in a row", (5, 6)),
        ("only the red can and the blue one in a line", (3, 4)),
        ("put the shortest cup and the tall can in a line", (0, 1, 4)),
        ("the reddish bowl and the greenish cups", (1, 2, 5)),
        ("not the red ones: line up the cups", (1, 2)),
        ("put the cups that are not red in a line", (1, 2)),
        ("put all objects that aren't red or brown in a line", (1, 2, 3)),
        ("put everything that is red in a line", (0, 4, 5)),
        ("the things which are green or blue in a row", (1, 2, 3)),
        ("put everything that's green or brown in a row", (1, 2, 6)),
        ("could you line up the non-red cups?", (1, 2)),
        ("I'd like the two tallest things side by side", (3, 4)),
        ("put the biggest of the cups and the box in a line", (2, 6)),
        ("put the two tallest of the objects in a line", (3, 4)),
    ],
)
def test_colours_and_sizes_choose(text, indices):
    if indices == (0, 1, 4):  # two cups are equally short
        with pytest.raises(
            AmbiguousReferenceError, match="'shortest cup' can be each of 2 objects: cup 1 .red.; cup 2"
        ):
            select_objects(text, CUPS)
        return
    assert select_objects(text, CUPS).indices == indices


@pytest.mark.parametrize("text", ["only the red one", "use just the red one", "put only the red object in a line"])
def test_only_one_is_one(text):
    objects = [thing("object 1", "red"), thing("object 2", "blue"), thing("object 3", "green")]
    assert select_objects(text, objects).indices == (0,)
    assert select_objects(text.replace("one", "ones").replace("object ", "objects "), objects).indices == (0,)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "put the purple cups in a line",
            r"names 'purple cup'; of that kind there is only: cup 1 \(red\); cup 2 \(green\)",
        ),
        ("the yellow ones in a circle", r"names 'yellow one'; of that kind there is only: cup 1 \(red\)"),
        ("three green cups in a line", r"names 3 of 'green cup'; of that kind there is only: cup 1"),
        ("everything but the pink cup in a line", r"leaves out 'pink cup'; of that kind there is only: cup 1"),
    ],
)
def test_a_colour_that_nothing_has_is_refused_with_what_is_there(text, message):
    with pytest.raises(SelectionError, match=message):
        select_objects(text, CUPS)


def test_sizes_that_are_alike_are_no_reason_to_choose():
    alike = [thing("cup 1", "red"), thing("cup 2", "blue"), thing("cup 3", "blue")]
    with pytest.raises(SelectionError, match="names 'tall cup', and their heights are too alike .*: 8.0 to 8.0 cm"):
        select_objects("put the tall cups in a line", alike)
    with pytest.raises(AmbiguousReferenceError):
        select_objects("the tallest cup and the blue cups in a line", alike)


def test_words_that_nothing_can_judge_are_told():
    selection = select_objects("put the heavy cups and the wooden box in a line", CUPS)
    assert selection.indices == (0, 1, 2, 6)
    assert selection.notes == (
        "it is not known which of the cups here are 'heavy': that word was left out of the choice",
        "it is not known which of the boxes here are 'wooden': that word was left out of the choice",
    )
    assert (
        select_objects("put the left cups in a row", CUPS)
        .notes[0]
        .endswith("are 'left': that word was left out of the choice")
    )
    assert select_objects("put the cups on the left", CUPS).notes == ()
    assert (
        select_objects("put the shiny objects in a line", CUPS)
        .notes[0]
        .startswith("it is not known which of the objects")
    )
    assert select_objects("put the green cups in a nice line", CUPS).notes == ()
    assert select_objects("heavy boxes in a row", ["wooden box", "cardboard box"]).notes
    assert not select_objects("wooden boxes in a row", ["wooden box", "cardboard box"]).notes


def test_several_that_fit_words_for_one_are_a_question():
    with pytest.raises(AmbiguousReferenceError) as raised:
        select_objects("put the green cup and the bowl in a line", CUPS)
    assert raised.value.indices == (1, 2) and raised.value.phrase == "green cup"
    assert "cup 2 (green); cup 3 (green)" in str(raised.value)
    answered = select_objects("put the green cup and the bowl in a line", CUPS, resolved={"green cup": 2})
    assert answered.indices == (2, 5)
    # "A green cup" and "one of the green cups" leave the choice to us.
    assert select_objects("put a green cup and the bowl in a line", CUPS).indices == (1, 5)
    assert select_objects("put one of the green cups and the bowl in a line", CUPS).indices == (1, 5)


@pytest.mark.parametrize("words", ["heavy cup", "medium sized cup", "salted can", "plastic cup"])
def test_a_word_that_cannot_be_judged_is_no_ground_to_pick_one(words):
    with pytest.raises(
        SelectionError, match=f"it is not known which of the objects here are .*, so that '{words}' can be each of"
    ):
        select_objects(f"put the {words} and the bowl in a line", CUPS)


def test_a_library_is_no_scene():
    """What a scene is drawn from: colours hold, sizes are judged on the table, and one of several is enough."""
    assert select_objects("put the green cups in a line", CUPS, catalogue=True).indices == (1, 2)
    assert select_objects("put the small cups in a line", CUPS, catalogue=True).indices == (0, 1, 2)
    assert select_objects("put the green cup and the bowl in a line", CUPS, catalogue=True).indices == (1, 5)
    assert select_objects("put the tallest two cans in a line", CUPS, catalogue=True).described


def test_what_has_to_take_part_is_known():
    assert select_objects("put the bowl and the cups in a line", CUPS).required == (5,)
    assert select_objects("put two cups in a line", CUPS).required == (0, 1)
    assert select_objects("put everything in a line", CUPS).required == ()


def test_the_place_of_another_object_is_no_selection():
    for words in ("behind the bowl", "next to the bowl", "to the left of the bowl", "around the bowl", "on the bowl"):
        with pytest.raises(SelectionError, match="a structure cannot be placed relative to single objects yet"):
            select_objects(f"put the cups in a line {words}", CUPS)
    assert select_objects("put the cups in a line with some space between the cups", CUPS).indices == (0, 1, 2)
    assert select_objects("put the cups in a line for the bowl", CUPS).indices == (0, 1, 2)


def test_a_filling_tells_boxes_apart():
    boxes = ["sugar box", "cracker box", "soup can"]
    assert select_objects("stack the box of crackers and the can", boxes).indices == (1, 2)


def test_colour_names_fit_by_their_best_name_first():
    known = [ObjectAttributes(("brown", "orange")), ObjectAttributes(("orange",)), ObjectAttributes(("red",))]
    assert of_color("orange", known) == [1]
    assert of_color("orange", [known[0], known[2]]) == [0]
    assert of_color("maroon", known) == [0, 2]
    assert of_color("blue", known) == []
    assert of_color("red", [*known, None]) is None


def test_sizes_split_at_the_widest_step():
    heights = [0.10, 0.20, 0.11, 0.19]
    known = [ObjectAttributes((), (0.1, 0.1, height)) for height in heights]
    assert of_size("tall", known) == [1, 3]
    assert of_size("short", known) == [0, 2]
    assert by_size("tall", known) == [1, 3, 2, 0]
    assert of_size("tall", known[:1]) is None  # nothing to compare with
    assert of_size("tall", [*known, ObjectAttributes()]) is None
