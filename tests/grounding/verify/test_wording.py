"""Goals as a person would ask for them."""

import pytest

from grounding.goals.goal import Goal
from grounding.verify.wording import worded_goal, worded_objects
from tests.grounding.goal_in_words import goal_of_words

NAMES = ("cup", "cup 2", "cup 3", "red mug", "blue mug", "bowl")


@pytest.mark.parametrize(
    ("indices", "words"),
    [
        ((0, 1, 2), "the three cups"),
        ((0, 1), "cup 1 and cup 2"),
        ((3, 4, 5), "the two mugs and the bowl"),
        ((5, 3, 0), "the bowl, red mug and cup 1"),
        (("the cans", "the jar"), "the cans and the jar"),
    ],
)
def test_objects(indices, words):
    assert worded_objects(indices, NAMES) == words


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        ("line of 0, 1, 2, left", "a line of the three cups on the left"),
        (
            "circle of 3, 4, 5, small, top, radius 10 cm",
            "a small circle of the two mugs and the bowl at the back with a radius of 10 cm",
        ),
        ("line of 0, 1, 2, facing east, gap 5 cm", "a line of the three cups facing right with 5 cm between them"),
        ("arc of everything else, around 5", "an arc of everything around the bowl"),
        ("grid of 0, 1, 2, 3, rows 2, columns 1", "a grid of the three cups and red mug with 2 rows and 1 column"),
        ("line of 0, 1, 2, along far", "a line of the three cups along the far edge"),
        ("cluster of everything else, group by colour", "a cluster of everything for each colour"),
        (
            "tower of 2, 0, order by listed from bottom",
            "a tower of cup 3 and cup 1 in this order, the first one at the bottom",
        ),
        (
            "line of 0, 1, 2, order by height descending from left",
            "a line of the three cups from tallest to shortest, the tallest on the left",
        ),
        ("line of 0, 1, 2, order by volume", "a line of the three cups by volume"),
        ("5 at left top", "put the bowl on the left at the back"),
        ("5 left of 3 by 10 cm", "put the bowl 10 cm to the left of red mug"),
        ("5 moved away by 5 cm", "move the bowl 5 cm away from me"),
        ("3, 5 swapped", "swap red mug and the bowl"),
        ("line of 0, 1, 2; 5 behind part 1", "a line of the three cups and put the bowl behind the line"),
    ],
)
def test_goals(goal, words):
    assert worded_goal(goal_of_words(goal), NAMES) == words


def test_the_rest_is_everything_else():
    parts = (
        {"kind": "relation", "relation": "on", "objects": [0], "reference": [5]},
        {"kind": "structure", "shape": "line", "objects": None},
    )
    assert (
        worded_goal(Goal.from_dict({"parts": list(parts)}), NAMES)
        == "put cup 1 on the bowl and a line of everything else"
    )
