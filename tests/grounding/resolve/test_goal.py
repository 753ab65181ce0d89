"""The objects of written goals, and of single phrases, in scenes, in a library and where nothing is known."""

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.resolve.attributes import ObjectAttributes, SceneObject
from grounding.resolve.errors import ResolveError, UnclearObjectsError
from grounding.resolve.goal import resolve_goal, resolve_phrase
from grounding.resolve.referents import Referents


def thing(name, colour="", length=0.08, width=0.08, height=0.08):
    return SceneObject(name, ObjectAttributes((colour,) if colour else (), (length, width, height)))


SCENES = {
    "cups": [
        thing("cup 1", "red", 0.06, 0.06, 0.06), thing("cup 2", "green", 0.06, 0.06, 0.061),
        thing("cup 3", "green", 0.10, 0.10, 0.10), thing("can 1", "blue", 0.07, 0.07, 0.11),
        thing("can 2", "red", 0.07, 0.07, 0.14), thing("bowl", "red", 0.16, 0.16, 0.055),
        thing("box", "brown", 0.20, 0.08, 0.04),
    ],
    "kitchen": ["cup", "mug", "can", "can", "can", "bowl", "plate", "fork", "knife", "spoon", "box", "cup"],
    "coloured": ["red cup", "blue cup", "red bowl", "white plate", "blue cup", "cup"],
    "groceries": [
        "005_tomato_soup_can", "007_tuna_fish_can", "003_cracker_box", "004_sugar_box", "006_mustard_bottle",
        "011_banana", "013_apple", "052_extra_large_clamp", "051_large_clamp", "072-a_toy_airplane", "065-a_cups",
    ],
    "described": ["object 1, green, flat", "object 2, red, tall", "object 3, red, flat", "cup 4, blue"],
    "study": ["pen", "stapler", "toy car", "teddy bear", "wine glass", "coffee mug", "ruler", "pencil", "book",
              "onion"],
    "numbered": ["cup 1", "cup 2", "cup 3", "bowl"],
    "gears": ["gearbox", "mug", "Gear_Box 2", "box"],
    "solids": ["cube", "cube 2", "moon", "star"],
}  # fmt: skip


def there(scene, encoder=None, **how):
    return Referents(SCENES.get(scene) or goal_scenes()[scene], encoder, **how)


PHRASES = [
    ("cups", "the green cups", (1, 2)),
    ("cups", "everything red", (0, 4, 5)),
    ("cups", "everything but the red ones", (1, 2, 3, 6)),
    ("cups", "the little green cup", (1,)),
    ("cups", "the two tallest objects", (4, 3)),
    ("cups", "the second tallest can", (3,)),
    ("cups", "the widest object", (5,)),
    ("cups", "the reddish bowl", (5,)),
    ("cups", "the things which are green or blue", (1, 2, 3)),
    ("cups", "the non-red cups", (1, 2)),
    ("cups", "the biggest of the cups", (2,)),
    ("cups", "a green cup", (1,)),
    ("cups", "one of the green cups", (1,)),
    ("kitchen", "the three cans", (2, 3, 4)),
    ("kitchen", "the can", (2,)),  # they cannot be told apart in words
    ("kitchen", "tins", (2, 3, 4)),
    ("kitchen", "the silverware", (7, 8, 9)),
    ("kitchen", "everything except for the cutlery and the cups", (1, 2, 3, 4, 5, 6, 10)),
    ("kitchen", "everything that is a can", (2, 3, 4)),
    ("kitchen", "all that is called a can", (2, 3, 4)),
    ("kitchen", "whatever is named can", (2, 3, 4)),
    ("kitchen", "fork knife spoon", (7, 8, 9)),
    ("kitchen", "forsk and bowels", (7, 5)),
    ("coloured", "the blue cups", (1, 4)),
    ("coloured", "the red and the blue cup", (0, 1)),
    ("coloured", "the white plate", (3,)),
    ("groceries", "the soup can", (0,)),
    ("groceries", "the sugar box and the mustard", (3, 4)),
    ("groceries", "the extra large clamp", (7,)),
    ("groceries", "the box of crackers", (2,)),
    ("groceries", "the fruit", (5, 6)),
    ("described", "object 2", (1,)),
    ("described", "object 1 and object 3", (0, 2)),
    ("described", "the flat ones", (0, 2)),
    ("study", "the writing things", (0, 7)),
    ("study", "whatever you can write with", (0, 7)),
    ("study", "drinkware", (4, 5)),
    ("study", "everything I can drink from", (4, 5)),
    ("numbered", "cup 2", (1,)),
    ("numbered", "cups 1 and 3", (0, 2)),
    ("gears", "the gear boxes", (0, 2)),
    ("solids", "the blocks", (0, 1, 2, 3)),
    ("tea party", "cup 2", (2,)),
    ("blocks", "blue", (2, 3)),
    ("party", "two of the red cups", (0, 1)),
]


@pytest.mark.parametrize(("scene", "phrase", "indices"), PHRASES)
def test_a_phrase_means_its_objects(scene, phrase, indices):
    if phrase == "blue":
        with pytest.raises(UnclearObjectsError) as raised:
            resolve_phrase(phrase, there(scene))
        assert raised.value.indices == indices
        return
    assert sorted(resolve_phrase(phrase, there(scene)).indices) == sorted(indices)


@pytest.mark.parametrize(
    ("scene", "phrase", "indices", "question"),
    [
        ("cups", "the green cup", (1, 2), "'the green cup' fits 2 objects: cup 2 (green); cup 3 (green); "
                                          "which one?"),
        ("cups", "the shortest cup", (0, 1), "'the shortest cup' fits 2 objects: cup 1 (red); cup 2 (green); "
                                             "which one?"),
        ("cups", "the mugs", (0, 1, 2), "there is no mug here; does 'the mugs' mean: cup 1 (red); cup 2 (green); cup 3 "
                                        "(green)?"),
        ("desk", "the cup", (0,), "there is no cup here; does 'the cup' mean: mug (black)?"),
        ("cups", "the bowl next to the can", (3, 4),
         "'the can' fits 2 objects: can 1 (blue); can 2 (red); which one?"),
    ],
)  # fmt: skip
def test_a_doubt_is_a_question_of_just_these_objects(scene, phrase, indices, question):
    with pytest.raises(UnclearObjectsError) as raised:
        resolve_phrase(phrase, there(scene))
    assert raised.value.indices == indices and str(raised.value) == question
    assert raised.value.question.options == tuple(there(scene).names[i] for i in indices)


@pytest.mark.parametrize(
    ("phrase", "problem"),
    [
        ("the banana", "nothing here is 'the banana'"),
        ("four green cups", "'four green cups' needs 4 objects, but there are 2"),
        ("the purple cups", "nothing here is 'the purple cups'"),
        ("the gizmos", "nothing here is called 'gizmos'"),
        ("everything but the unicorn", "nothing here is called 'unicorn'"),
        ("the heavy cup", "it is not known which of the objects here are 'heavy'"),
        ("bowls corresponding", "it is not clear which objects 'bowls corresponding' means"),
        ("the leftmost cup", "it is not known where the objects stand"),
    ],
)
def test_what_is_not_there_is_said_with_what_is(phrase, problem):
    with pytest.raises(ResolveError) as raised:
        resolve_phrase(phrase, there("cups"))
    assert not isinstance(raised.value, UnclearObjectsError)
    assert str(raised.value) == f"{problem}; there is only: cup 1, cup 2, cup 3, can 1, can 2, bowl, box"


def test_a_word_that_nothing_can_judge_is_left_out_of_a_plural_with_a_note():
    found = resolve_phrase("the shiny cups", there("cups"))
    assert found.indices == (0, 1, 2) and found.nouns == ("cup",)
    assert found.notes == ("it is not known which of the objects here are 'shiny': that word was ignored",)


@pytest.mark.parametrize(
    ("phrase", "names", "indices"),
    [
        ("the locomotives", ["train", "cup", "train"], (0, 2)),
        ("the gemstones", ["stone", "book", "stone"], (0, 2)),
        ("everything but the timepiece", ["clock", "lemon", "purse"], (1, 2)),
    ],
)
def test_the_encoder_finds_what_no_table_knows(encoder, phrase, names, indices):
    with pytest.raises(ResolveError, match="nothing here is called"):
        resolve_phrase(phrase, Referents(names))
    found = resolve_phrase(phrase, Referents(names, encoder))
    assert found.indices == indices and "is read as" in found.notes[0]


def test_what_only_its_doings_describe_is_not_guessed(encoder):
    with pytest.raises(ResolveError, match="nothing here is called 'ringing'"):
        resolve_phrase("the ringing thing", there("office", encoder))


@pytest.mark.parametrize("noun", ["politicians", "gizmos", "violins", "planets", "problems", "mermaids", "guitars"])
def test_the_encoder_does_not_guess(encoder, noun):
    with pytest.raises(ResolveError, match="there is only"):
        resolve_phrase(f"the {noun}", Referents([*SCENES["kitchen"], *SCENES["study"], "hammer"], encoder))


def test_across_the_table_the_back_is_the_front():
    back = resolve_phrase("the blocks at the back", there("blocks", opposite=True)).indices
    assert back == resolve_phrase("the blocks at the front", there("blocks")).indices


def test_the_one_between_two_others_is_found_by_its_place():
    scene = [
        SceneObject(name, ObjectAttributes((colour,), (0.1, 0.1, 0.05), at))
        for name, colour, at in (
            ("bowl", "black", (0.4, 0.0)), ("bowl 2", "black", (0.6, 0.2)), ("plate", "white", (0.4, 0.25)),
            ("ramekin", "white", (0.4, -0.25)),
        )
    ]  # fmt: skip
    assert resolve_phrase("the black bowl between the plate and the ramekin", Referents(scene)).indices == (0,)


# Goals


def relation(name, objects, reference=None, **keys):
    return {"kind": "relation", "relation": name, "objects": objects, "reference": reference} | keys


def structure(shape, objects, **keys):
    return {"kind": "structure", "shape": shape, "objects": objects} | keys


@pytest.mark.parametrize(
    ("scene", "parts", "kept", "goal"),
    [
        ("party", [relation("in", ["everything"], ["the bowl"])], (), "0, 1, 2, 3, 4, 5 in 6"),
        ("party", [structure("line", ["the cups"])], ("the red ones",), "line of 3, 4, 5"),
        ("party", [structure("line", None)], ("the bowl",), "line of 0, 1, 2, 3, 4, 5"),
        ("blocks", [structure(None, ["the orange block"], x_position="left")], (), "8 at left"),
        ("blocks", [relation("at", ["the red blocks"], x_position="left")], (), "structure of 0, 1, left"),
        ("blocks", [structure("tower", ["the reds"]), structure("circle", ["the rest"])], (),
         "tower of 0, 1; circle of everything else"),
    ],
)  # fmt: skip
def test_a_goal_has_objects_in_place_of_words(scene, parts, kept, goal):
    assert str(resolve_goal(parts, there(scene), kept=kept).goal) == goal


def test_known_phrases_keep_their_objects():
    parts = [structure("line", ["cup", "the bowl"])]
    assert str(resolve_goal(parts, there("party"), known={"cup": (3, 4)}).goal) == "line of 3, 4, 6"


def test_a_goal_that_is_not_legal_is_refused():
    with pytest.raises(ResolveError, match="bowl cannot be on itself"):
        resolve_goal([relation("on", ["the bowl"], ["the bowl"])], there("party"))
    with pytest.raises(ResolveError, match="moves the same objects that it says to leave alone"):
        resolve_goal([structure("line", ["the bowl"])], there("party"), kept=("the bowl",))


def test_a_phrase_within_itself_ends():
    """Read among the likeliest goals of instructions of the benchmark: the group of "the other one" is "the others"."""
    text = "put the jar left, the tallest of the others right and the other one in front"
    phrases = ("the jar", "the tallest of the others", "the other one")
    parts = [relation("at", [phrase], x_position="left") for phrase in phrases]
    with pytest.raises(UnclearObjectsError, match="'the other one' fits 3 objects"):
        resolve_goal(parts, there("tall and short"), text)


# Libraries, and no objects at all


@pytest.mark.parametrize(
    ("parts", "goal"),
    [
        ([structure("line", ["the four leftmost cups"])], "line of 0, 1, 2"),
        ([structure("line", ["the green cups"])], "line of 1, 2"),
        ([structure("tower", ["everything"])], "tower of everything else"),
        ([structure("circle", ["the small cans"], around=["the bowl"])], "circle of 3, 4, around 5"),
        ([relation("next to", ["the cup"], ["the green cup"])], "0 next to 1"),
        ([relation("between", ["the bowl"], ["the cans"])], "5 between 3, 4"),
        ([relation("swapped", ["two cups"])], "0, 1 swapped"),
    ],
)
def test_a_library_offers_all_of_a_noun(parts, goal):
    assert str(resolve_goal(parts, there("cups", catalogue=True)).goal) == goal


def test_what_a_library_lacks_is_said():
    with pytest.raises(ResolveError, match="nothing here is 'the bananas'; there is only: cup 1"):
        resolve_goal([structure("line", ["the bananas"])], there("cups", catalogue=True))


@pytest.mark.parametrize(
    ("parts", "goal"),
    [
        ([structure("line", ["the red and blue mugs"])], "line of red and blue mugs"),
        ([structure("line", ["The Mug and the bowl"])], "line of Mug, bowl"),
        ([structure("line", ["the gizmos"])], "line of gizmos"),
        ([structure("line", ["all of them"])], "line of everything else"),
        ([structure("line", ["them"])], "line of everything else"),
        ([structure("tower", ["the cans"]), structure("line", ["the rest"])], "tower of cans; line of everything else"),
        ([structure("line", ["everything but the bowl"])], "line of everything but the bowl"),
        ([relation("in", ["everything"], ["the box"])], "everything in box"),
    ],
)
def test_words_stay_where_nothing_is_known(parts, goal):
    assert str(resolve_goal(parts, Referents(None)).goal).replace("'", "").replace('"', "") == goal


def test_a_pronoun_of_nothing_is_refused():
    with pytest.raises(ResolveError, match="it is not clear what 'it' refers to"):
        resolve_goal([relation("in", ["it"], ["the box"])], Referents(None))
