"""Where texts name figures, and where the same words are objects, places, verbs or letters."""

import pytest

from grounding.propose.example_words import like_mentions
from grounding.propose.figure_mentions import mentions_of
from grounding.propose.qualifiers import qualified
from grounding.resolve.attributes import SceneObject

TOYS = [SceneObject(name) for name in ("star", "heart", "cube 1", "cube 2", "cup B", "toy house")]


@pytest.mark.parametrize(("text", "names"), [
    ("put the cups in a big heart", ["heart"]),
    ("Hearts everywhere: one heart of cups, another heart of cans", ["heart", "heart", "heart"]),
    ("a letter t out of the cans", ["letter T"]),
    ("make a T and an L", ["letter T", "letter L"]),
    ("an A of cups, an I of cans", ["letter A", "letter I"]),
    ("the cans as an S-shape", ["letter S"]),
    ("number 7 from the cups", ["digit 7"]),
    ("a 7 out of cans", ["digit 7"]),
    ("write HI with the blocks", ["word HI"]),
    ("WRITE HI WITH THE BLOCKS", ["word HI"]),
    ("spell “no” with the blocks", ["word NO"]),
    ("write T with the cans", ["letter T"]),
    ("Write Hi with the cans", ["word HI"]),
        ("write hi with the cans", ["word HI"]),
    ("stairs!", ["stairs"]),
    ("a brick-wall of boxes", ["brick wall"]),
])  # fmt: skip
def test_figures(text, names):
    assert [one.name for one in mentions_of(text, None)] == names


@pytest.mark.parametrize("text", [
    "I want a line", "A line of cups", "crown the stack with the white cup", "put the star left of the heart",
    "the bridge block on the left", "make a 5 cm gap", "a 3 by 3 grid", "a half moon of cups",
    "both mugs plus the bowl in a line",
    "a plus sign of the blocks", "write with the blocks", "not a word about it", "cup B on the left",
    "put the toy house there",
    "in the middle of table", "object number 7 on the left",
])  # fmt: skip
def test_other_words(text):
    assert mentions_of(text, TOYS) == ()


def test_the_figure_of_the_goal_so_far_is_meant_by_its_name():
    assert mentions_of("turn the heart around", None) == ()
    assert [one.name for one in mentions_of("turn the heart around", None, {"heart"})] == ["heart"]
    assert [one.name for one in mentions_of("make it NO", None, {"word HI"})] == ["word NO"]


@pytest.mark.parametrize(("text", "words"), [
    ("the same with the cups", "the same"), ("make another one like this with the cans", "another one like this"),
    ("build it with the cups", "it"), ("put the cups in a line", ""),
])  # fmt: skip
def test_words_for_an_example(text, words):
    assert [text[one.first : one.end] for one in like_mentions(text, "like x")] == ([words] if words else [])


@pytest.mark.parametrize(("text", "words", "shape"), [
    ("build another city gate", ("city",), "gate"), ("a Roman bridge", ("Roman",), "bridge"),
    ("build Roman bridges", ("Roman",), "bridge"),
    ("a spiral staircase out of the blocks", ("spiral",), "stairs"), ("a broken heart", ("broken",), "heart"),
    ("a Gothic arch on the left", ("Gothic",), "arc"), ("an old stone bridge, please", ("old", "stone"), "bridge"),
    ("a nice medieval little castle", ("medieval",), "castle"), ("a Greek letter T", ("Greek",), "letter T"),
    ("a lucky 7 out of the cubes", ("lucky",), "digit 7"), ("London's bridge", ("London's",), "bridge"),
    ("a tall gate", ("tall",), "gate"),
    ("Roman bridge, please", ("Roman",), "bridge"),
])  # fmt: skip
def test_what_qualifies_a_figure_is_found(text, words, shape):
    (found,) = qualified(text, TOYS, mentions_of(text, TOYS))
    assert (found.words, found.shape) == (words, shape)
    assert found.size == ("little" if "little" in text else "")


@pytest.mark.parametrize("text", [
    "a big heart", "a nice little house", "a Christmas tree", "a brick wall of boxes", "make a fancy T",
    "a five-pointed star", "a cube heart", "create hearts", "heart-shaped, please", "put the cups in a neat circle",
    "write HI with the blocks", "a crescent moon of cups", "the cups in a small star on the left",
])  # fmt: skip
def test_sizes_praise_and_names_of_objects_qualify_nothing(text):
    assert [one for one in qualified(text, TOYS, mentions_of(text, TOYS)) if one.words] == []


@pytest.mark.parametrize(("text", "follows", "words"), [
    ("the same with the cups", False, "the same"), ("one like this", False, "one like this"),
    ("put it on the left", False, ""),
    ("the same with the cups", True, ""), ("another one like the example", True, "another one like the example"),
    ("build the example with the cups", True, "the example"),
    ("a copy of the example, but large", True, "a copy of the example"),
    ("for example, a line", True, ""),
])  # fmt: skip
def test_in_a_conversation_only_clear_words_are_about_the_example(text, follows, words):
    found = like_mentions(text, "like x", always=False, follows=follows)
    assert [text[one.first : one.end] for one in found] == ([words] if words else [])
