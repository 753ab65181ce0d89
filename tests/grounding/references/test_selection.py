"""Which objects an instruction means."""


import pytest

from grounding.references.selection import AmbiguousReferenceError, SelectionError, mentioned, select_objects
from tests.counting import counted_lines

MOST_LINES = 10_000

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


def test_either_word_means_an_object_that_is_one_of_two():
    names = ["cup or mug 1, red", "cup 2, blue", "bowl 3, red"]
    assert select_objects("the mugs", names).indices == (0,)
    assert select_objects("the cups", names).indices == (0, 1)
    assert select_objects("everything but the mug", names).indices == (1, 2)


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


@pytest.mark.parametrize("names", [["object", "object"], [None, ""], ["Object", " "]])
def test_without_names_nothing_can_be_named(names):
    assert select_objects("put everything in a row", names).indices == (0, 1)
    assert select_objects("put these objects in a row", names).indices == (0, 1)
    assert select_objects("put object 2 on the left", names).indices == (1,)
    with pytest.raises(SelectionError, match="no names; there is only: object 1, object 2"):
        select_objects("the cups in a row", names)


def test_a_category_that_no_list_knows_is_a_noun_too():
    assert select_objects("line up the gizmos", ["gizmo", "cup", "brass gizmo"]).indices == (0, 2)


COLOURED = ["red cup", "blue cup", "red bowl", "white plate", "blue cup", "cup"]
GROCERIES = [
    "005_tomato_soup_can", "007_tuna_fish_can", "003_cracker_box", "004_sugar_box", "006_mustard_bottle",
    "011_banana", "013_apple", "052_extra_large_clamp", "051_large_clamp", "072-a_toy_airplane", "065-a_cups",
    "019_pitcher_base",
]  # fmt: skip
DESCRIBED = ["object 1, green, flat", "object 2, red, tall", "object 3, red, flat", "cup 4, blue"]
OFFICE = [
    "pen",
    "stapler",
    "toy car",
    "teddy bear",
    "wine glass",
    "coffee mug",
    "ruler",
    "pencil",
    "book",
    "onion",
]
SCENES = {
    "coloured": COLOURED,
    "groceries": GROCERIES,
    "described": DESCRIBED,
    "office": OFFICE,
    "kitchen": KITCHEN,
    "numbered": ["cup 1", "cup 2", "cup 3", "bowl"],
    "recorded": ["object 1, red", "object 2, green, tall", "object 3, blue", "object 4, yellow, tall"],
}


def _but(scene, *indices):
    return tuple(i for i in range(len(SCENES[scene])) if i not in indices)


CASES = [
    # adjectives
    ("coloured", "put the red cup on the left", (0,)),
    ("coloured", "line up the blue cups", (1, 4)),
    ("coloured", "a ring of shiny cups", (0, 1, 4, 5)),
    ("coloured", "put all the red things at the back", (0, 2)),
    ("coloured", "stack the blue ones near me", (1, 4)),
    ("coloured", "the cups in a circle, but not the red one", (1, 4, 5)),
    ("coloured", "everything that's not the white plate goes right", _but("coloured", 3)),
    ("coloured", "a line of the red bowl and the white plate", (2, 3)),
    ("coloured", "two blue cups in a row", (1, 4)),
    # one noun for several adjectives
    ("coloured", "line up the red and the blue cup", (0, 1)),
    ("coloured", "stack the red and blue cups", (0, 1, 4)),
    ("coloured", "a row of one red and two blue cups", (0, 1, 4)),
    ("coloured", "everything but the red and the blue ones", _but("coloured", 0, 1, 2, 4)),
    ("coloured", "line up the cups on the left and the white plate", (0, 1, 3, 4, 5)),
    ("recorded", "put the red and the blue object in a line", (0, 2)),
    ("recorded", "the red, the green and the blue one in a circle", (0, 1, 2)),
    ("recorded", "put the red and the tall yellow object in a line", (0, 3)),
    ("coloured", "line up the green cup and the bowl", (2, 5)),  # a cup without a colour may be green
    # compounds and long names
    ("groceries", "stack the soup can and the tuna can", (0, 1)),
    ("groceries", "put the cans in a row", (0, 1)),
    ("groceries", "the sugar box and the mustard next to each other", (3, 4)),
    ("groceries", "put the extra large clamp at the front", (7,)),
    ("groceries", "line up the clamps", (7, 8)),
    ("groceries", "put the pitcher on the left", (11,)),
    ("groceries", "the fruit in a circle", (5, 6)),
    ("groceries", "line up the toys", (9,)),
    ("groceries", "pile up the crackers and the sugar", (2, 3)),
    ("groceries", "stack tomato soup, tuna fish and the box of crackers", (0, 1, 2)),
    ("groceries", "all the tools facing me in a line", (7, 8)),
    # descriptions and numbers of objects
    ("described", "put object 2 on the right", (1,)),
    ("described", "line up object 1 and object 3", (0, 2)),
    ("described", "the red objects in a row", (1, 2)),
    ("described", "stack the flat ones", (0, 2)),
    ("described", "put the cup at the back", (3,)),
    ("described", "all the things in a circle", (0, 1, 2, 3)),
    ("described", "three objects in a ring", (0, 1, 2)),
    # groups
    ("office", "line up the writing things", (0, 7)),
    ("office", "the toys in a circle", (2, 3)),
    ("office", "put the stationery at the back", (0, 1, 6, 7)),
    ("office", "everything I can drink from on the left", (4, 5)),
    ("office", "whatever you can write with in a row", (0, 7)),
    ("office", "ring of drinkware", (4, 5)),
    ("kitchen", "the kitchen stuff in a ring", (0, 1, 5, 6, 7, 8, 9, 11)),
    ("kitchen", "put the tableware on the right", (0, 1, 5, 6, 7, 8, 9, 11)),
    # numbers
    ("kitchen", "two of the cans on the left", (2, 3)),
    ("kitchen", "a couple of cans in a row", (2, 3)),
    ("kitchen", "stack both cups", (0, 11)),
    ("kitchen", "all but one of the cans in a pile", (2, 3)),
    ("kitchen", "one of the cups and the plate in a row", (0, 6)),
    ("kitchen", "stack a can on the right, just one can", (2,)),
    ("kitchen", "line up two cans, both cups, a fork and a knife", (0, 2, 3, 7, 8, 11)),
    ("kitchen", "the 3 cans", (2, 3, 4)),
    # exceptions
    ("kitchen", "everything apart from the cutlery in a circle", _but("kitchen", 7, 8, 9)),
    ("kitchen", "all except the plate and the bowl", _but("kitchen", 5, 6)),
    ("kitchen", "make a circle, but leave the bowl where it is", _but("kitchen", 5)),
    ("kitchen", "Line everything up. Don't touch the knife!", _but("kitchen", 8)),
    ("kitchen", "put them in a row without the box", _but("kitchen", 10)),
    ("kitchen", "a big ring, skip the mug", _but("kitchen", 1)),
    ("kitchen", "line it all up; the plate stays where it is", _but("kitchen", 6)),
    ("kitchen", "arrange the lot except for two of the cans", _but("kitchen", 2, 3)),
    ("kitchen", "all of it on the left, with the exception of the spoon", _but("kitchen", 9)),
    ("kitchen", "anything but the bowl, in a row", _but("kitchen", 5)),
    ("kitchen", "nothing but the cups in a row", (0, 11)),
    ("kitchen", "the dishes, not the cans, in a circle", (5, 6)),
    ("kitchen", "not the cups but the cans in a row", (2, 3, 4)),
    ("kitchen", "leave out the bowls and the plates and make a line", _but("kitchen", 5, 6)),
    ("kitchen", "keep the mug where it is and line up the rest", _but("kitchen", 1)),
    ("kitchen", "we don't need the knife; everything else in a row", _but("kitchen", 8)),
    # nouns that are no objects of the wish
    ("kitchen", "a ring for my grandmother on the left side of the table", _but("kitchen")),
    ("kitchen", "line them up before lunch", _but("kitchen")),
    ("kitchen", "The bowl on the left is hot; put the cups in a row.", (0, 11)),
    ("kitchen", "The cups came in that box. Line them up.", (0, 11)),
    ("kitchen", "put the cups in a circle like the plates yesterday", (0, 11)),
    ("kitchen", "put the cans in a row so that I can reach the box", (2, 3, 4)),
    ("kitchen", "If the plate is in the way, never mind: stack the cans.", (2, 3, 4)),
    ("kitchen", "lay the table for my mother, she had a plate for breakfast", _but("kitchen")),
    ("kitchen", "a row of cans, with the labels facing me", (2, 3, 4)),
    ("kitchen", "could you set the table for dinner, my guest likes fish", _but("kitchen")),
    # from instructions that were wrong at first
    ("kitchen", "Make a line with everything that isn't a can", _but("kitchen", 2, 3, 4)),
    ("kitchen", "put them all in a ring, except the ones you drink from", _but("kitchen", 0, 1, 11)),
    ("kitchen", "pile up the cans, and mind the bowl", (2, 3, 4)),
    ("kitchen", "I need the knife out of the way, so put the others in a ring", _but("kitchen", 8)),
    ("kitchen", "can you get the cups out of the way? into the back left corner with them", (0, 11)),
    ("kitchen", "get the cups out of the way and stack the cans on the left", (2, 3, 4)),
    ("kitchen", "neither the fork nor the knife should move; a row of the others", _but("kitchen", 7, 8)),
    ("kitchen", "not the cups, the bowl", (5,)),
    ("kitchen", "the fork and knife may stay, the rest goes in a circle", _but("kitchen", 7, 8)),
    ("kitchen", "cup fork spoon, row, left", (0, 7, 9)),
    ("coloured", "everything blue to the left", (1, 4)),
    ("coloured", "put the second cup on the left", (1,)),
    ("coloured", "put the last cup on the left", (5,)),
    ("office", "pen and book, side by side", (0, 8)),
    ("office", "I'm writing a letter, so please line up the pens", (0,)),
    ("numbered", "put cup 2 and the bowl in a line", (1, 3)),
    ("numbered", "cups 1 and 3 in a row", (0, 2)),
    ("numbered", "everything except cup 1", (1, 2, 3)),
    # spelling
    ("kitchen", "put the forsk, plats and bowels in a row", (5, 6, 7)),
    ("office", "line up the stapplers", (1,)),
]


@pytest.mark.parametrize(("scene", "text", "indices"), CASES)
def test_selection(scene, text, indices):
    assert select_objects(text, SCENES[scene]).indices == indices


@pytest.mark.parametrize(
    ("text", "names", "message"),
    [
        ("put the gizmos in a line", KITCHEN, "names 'gizmo'; there is only: 2 x cup, mug, 3 x can"),
        ("a circle of acorns", KITCHEN, "names 'acorn'; there is only"),
        ("unicorns in a circle", KITCHEN, "names 'unicorn'"),
        ("everything but the unicorn in a row", KITCHEN, "leaves out 'unicorn'; there is only"),
        (
            "the green cups in a row",
            ["red cup", "blue cup"],
            "names 'green cup'; there is only: red cup, blue cup",
        ),
        ("stack four red cups", ["red cup", "red cup", "cup"], "names 4 of 'red cup'"),
    ],
)
def test_what_cannot_be_found_is_answered_with_what_is_there(text, names, message):
    with pytest.raises(SelectionError, match=message):
        select_objects(text, names)


@pytest.mark.parametrize(
    ("text", "names", "indices"),
    [
        ("line up the locomotives", ["train", "cup", "train"], (0, 2)),
        ("put the gemstones in a circle", ["stone", "book", "stone"], (0, 2)),
        ("the sneakers in a row", ["shoe", "hat", "shoe"], (0, 2)),
        ("a row of handbags", ["purse", "lemon", "purse"], (0, 2)),
        ("everything but the timepiece", ["clock", "lemon", "purse"], (1, 2)),
    ],
)
def test_the_encoder_finds_what_no_table_knows(encoder, text, names, indices):
    with pytest.raises(SelectionError):
        select_objects(text, names)
    assert select_objects(text, names, encoder).indices == indices


@pytest.mark.parametrize(
    "noun", ["politicians", "gizmos", "violins", "planets", "problems", "mermaids", "guitars"]
)
def test_the_encoder_does_not_guess(encoder, noun):
    with pytest.raises(SelectionError, match="there is only"):
        select_objects(f"put the {noun} in a row", [*KITCHEN, *OFFICE, "hammer"], encoder)


def test_words_of_the_instruction_where_there_is_no_scene():
    assert mentioned("stack the three cans on the left") == ("three cans",)
    assert mentioned("everything but the bowl in a row") == ("everything but the bowl",)
    assert mentioned("fork, knife and plate side by side") == ("fork", "knife", "plate")
    assert mentioned("a ring of red cups, not the mug") == ("red cups", "not the mug")
    assert mentioned("line up the doohickeys") == ("doohickeys",)
    for text in (
        "make a circle",
        "put everything on the left",
        "set the table for my guests",
        "",
        "bigger",
        "stack them",
    ):
        assert mentioned(text) == ()


@pytest.mark.parametrize(
    "text",
    [
        "",
        "\x00\x07",
        "🍎🍌 ➡️ ⭕",
        "ضع الأكواب في دائرة",
        "{}%s{0}",
        "can",
        "but but but",
        "the",
        "İİİ cups",
        "1" * 5000,
    ],
)
def test_any_string_gives_a_selection_or_a_reason(text):
    try:
        assert select_objects(text, KITCHEN).indices
    except SelectionError as error:
        assert "there is" in str(error)
    assert isinstance(mentioned(text), tuple)


@pytest.mark.parametrize(
    "piece",
    ["cups ", "the ", "but the cup, ", "of ", "red ", ", so if ", "all of the ", "(((", "x", "red and the blue "],
)
def test_long_texts_take_steps_in_proportion(piece):
    def taken(size):
        text = piece * (size // len(piece))
        with counted_lines() as steps:
            for call in (lambda: select_objects(text, KITCHEN), lambda: mentioned(text)):
                try:
                    call()
                except SelectionError:
                    pass
        return steps.count

    assert taken(12_000) < 3.0 * taken(6_000)


def test_a_sentence_takes_a_few_thousand_steps():
    with counted_lines() as steps:
        for scene, text, _ in CASES:
            select_objects(text, SCENES[scene])
            mentioned(text)
    assert steps.count / len(CASES) < MOST_LINES


def test_an_object_between_two_colours_fits_both_and_makes_a_question():
    tins = ["object 1, red", "object 2, brown or purple, tall", "object 3, brown"]
    with pytest.raises(AmbiguousReferenceError, match="object 2, brown or purple, tall; object 3, brown; which one"):
        select_objects("put the brown one and the red one in a line", tins)
    assert select_objects("put the purple one and the red one in a line", tins).indices == (0, 1)
