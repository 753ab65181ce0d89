"""What "that one", "it", "those three" and "the pair" mean by what the instruction named before."""

import pytest

from grounding.resolve.phrase import PhraseGroup


def phrase(words, part=0, role="objects"):
    return PhraseGroup((words,), role, False, part)


@pytest.mark.parametrize(
    ("scene", "text", "words", "found"),
    [
        ("shapes", "You've got a red cylinder as well! Put that one beside the red cube.", "that one", [3]),
        ("blocks", "In the front row there's a blue block on my left. That one, on the green one.", "That one", [2]),
        ("garden", "Of the three pots there's one that isn't brown. I'd like that one at the back.", "that one", [2]),
        ("office", "Sorry, the phone. It goes to the back.", "It", [6]),
        ("grocery", "The lemon's for me, the pear's for Ann, the orange is for no one. The three of them in a line.",
         "the three of them", [4, 5, 6]),
        ("grocery", "There's an orange and a lemon. That pair goes left.", "that pair", [4, 5]),
        ("party", "I like the three red cups. Those three go left.", "those three", [0, 1, 2]),
        ("tall and short", "Of the bottle and the jar, the shorter one goes in front.", "the shorter one", [3]),
    ],
)  # fmt: skip
def test_a_pronoun_means_what_was_named_last(meant, scene, text, words, found):
    assert meant(scene, text, phrase(words)) == [found]


@pytest.mark.parametrize(
    ("scene", "text", "words"),
    [
        ("toys", "There's a ball over there. Put that one on the block.", "that one"),
        ("toys", "There's a ball. Put that ball on the block.", "that ball"),
        ("shapes", "Put that one beside the red cube.", "that one"),
        ("tall and short", "Put the shorter one in front.", "the shorter one"),
        ("grocery", "The lemon, the pear and the orange and the carton. Those three go left.", "those three"),
    ],
)
def test_a_pronoun_of_nothing_certain_is_not_read(meant, scene, text, words):
    assert isinstance(meant(scene, text, phrase(words))[0], Exception)


def test_a_thing_is_not_placed_beside_itself(meant):
    text = "put the red ball into the far left corner and the blue ball to the right of it"
    groups = phrase("the red ball"), phrase("the blue ball", 1), phrase("it", 1, "reference")
    assert meant("toys", text, *groups) == [[0], [1], [0]]


def test_the_other_one_is_of_the_group_before_it(meant):
    text = "The taller of the two bottles goes left, the other one right."
    assert meant("bathroom", text, phrase("The taller of the two bottles"), phrase("the other one", 1)) == [[1], [2]]


def test_a_plate_is_not_for_certain_smaller_than_a_bowl(meant):
    assert isinstance(meant("dinner", "", phrase("the bigger of the two round dishes"))[0], Exception)
