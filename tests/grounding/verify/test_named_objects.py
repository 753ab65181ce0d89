"""Objects that a text names and a goal leaves out."""

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goals.goal import Goal
from grounding.resolve.referents import Referents
from grounding.verify.named_objects import named_objects, unused
from tests.grounding.goal_in_words import goal_of_words


@pytest.mark.parametrize(
    ("scene", "text", "goal", "kept", "left"),
    [
        ("fruit and plate", "the blue can, the red can and both apples in a ring around the plate",
         "circle of 5, 1, 2, around 0", (),
         ("the blue can",)),
        ("fruit and plate", "the blue can, the red can and both apples in a ring around the plate",
         "circle of 4, 5, 1, 2, around 0", (), ()),
        ("breakfast", "the mugs and the bowl in a line", "line of 1, 2", (), ()),  # one of the mugs is there
        ("breakfast", "put the spoon on the plate and leave the banana", "4 on 3", ("the banana",), ()),
        ("breakfast", "put the spoon on the plate and the banana in the bowl", "4 on 3", (),
         ("the banana in the bowl", "the bowl")),
        ("breakfast", "put the spoon on the plate and the banana in the bowl", "structure of everything else, left", (),
         ()),
    ],
)  # fmt: skip
def test_phrases_whose_objects_a_goal_does_not_have(scene, text, goal, kept, left):
    named = named_objects(text, Referents(goal_scenes()[scene]))
    assert unused(named, goal_of_words(goal), Goal(), kept) == left


def test_what_leaves_the_goal_so_far_is_not_left_out():
    named = named_objects("without the banana", Referents(goal_scenes()["breakfast"]))
    assert unused(named, goal_of_words("line of 0, 1"), goal_of_words("line of 0, 1, 5")) == ()


def test_where_nothing_is_known_no_phrase_means_objects():
    assert named_objects("stack the cans", Referents(None)) == ()
