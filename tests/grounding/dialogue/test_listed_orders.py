"""Orders that a correction lists, object by object."""

import pytest

from grounding.goals.goal import Goal
from tests.grounding.dialogue.test_line_ends import LINE, LISTED, listed, say, structure  # noqa: F401


@pytest.mark.parametrize(
    ("part", "text", "then"),
    [
        (LINE, "the order should be green cup, red cup, blue cup", structure([2, 0, 1], listed())),
        (LINE, "green cup, red cup, blue cup in that order", structure([2, 0, 1], listed())),
        (LISTED, "no, the order is green cup, then red cup and blue cup", structure([2, 0, 1], listed("left"))),
    ],
)
def test_an_order_is_taken_as_it_is_listed(say, part, text, then):  # noqa: F811
    found = say(part, text)
    assert (found.status, found.goal) == ("ok", Goal.from_dict({"parts": [then]})), found.message


def test_a_list_without_all_of_the_objects_orders_nothing(say):  # noqa: F811
    found = say(LISTED, "the order should be green cup, red cup")
    assert found.goal == Goal.from_dict({"parts": [LISTED]})
