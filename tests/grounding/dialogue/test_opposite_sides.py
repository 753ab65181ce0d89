"""Objects on the other side of what another one was placed by."""

import pytest

from grounding.goals.goal import Goal
from tests.grounding.dialogue.test_revise_goal import FRUIT, ROW, goal, relation, say  # noqa: F401

BEHIND = [relation("behind", [0], [3])]
BOTH = [relation("left of", [0], [3]), relation("behind", [1], [4])]


@pytest.mark.parametrize(
    ("last", "text", "more"),
    [
        (BEHIND, "and the bowl on the opposite side", relation("in front of", [4], [3])),
        (BEHIND, "put the bowl on the other side of the plate", relation("in front of", [4], [3])),
        (BOTH, "the banana goes on the other side of the bowl", relation("in front of", [5], [4])),
        (ROW, "and the plate on the other side of it", relation("right of", [3], {"part": 0})),
    ],
)
def test_the_other_side_is_that_of_the_same_object(say, last, text, more):  # noqa: F811
    found = say(last, text)
    assert (found.status, found.goal) == ("ok", goal([*last, more])), found.message


@pytest.mark.parametrize(("last", "text"), [(BOTH, "the banana on the other side"), (FRUIT, "bowl on the other side")])
def test_it_is_not_guessed_which_one(say, last, text):  # noqa: F811
    found = say(last, text)
    assert found.goal == Goal.from_dict({"parts": last}) or found.status == "ask"
