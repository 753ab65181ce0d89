"""What the tool says of a build, read from its events."""

import numpy as np

from agent.arm.events import Disturbed, Noticed, Picked, Placed, PlaceFailed, StandingChanged, Stopped
from agent.evaluation.loop.account import account_of


def picked(index):
    return Picked(index, f"can {index}", "side", 1, 3, "friction")


def placed(index, trouble="", aside=False):
    return Placed(index, f"can {index}", aside, 0.0, 0.0, np.eye(4), 1.0, trouble)


def noticed(index, action="place again"):
    return Noticed(index, f"can {index}", "moved", "was moved by 5 cm", action)


PUSHED = Disturbed("push", 0, "can 0", "was pushed by 5.0 cm")


def test_what_stands_is_what_was_said_last():
    assert account_of([picked(0), placed(0), placed(1, "lies 90 degrees off")], {2}).stands == {0, 2}
    assert account_of([placed(0), StandingChanged(0, "can 0", False, "lies", "can 1 was placed")]).stands == frozenset()
    assert account_of([placed(0), picked(0)]).stands == account_of([placed(0), PlaceFailed(0, "", "")]).stands == set()
    assert account_of([placed(0, aside=True)]).stands == set()
    assert account_of([placed(0), noticed(0)]).stands == set()
    assert account_of([placed(0), noticed(0, "go on")]).stands == {0}
    assert account_of([placed(0), noticed(0), placed(0)]).stands == {0}


def test_what_is_left_out():
    assert account_of([placed(0), noticed(0, "leave out")]).left_out == {0}
    assert account_of([noticed(0)]).left_out == set()
    assert account_of([noticed(0, "lay out anew"), placed(0)]).left_out == set()


def test_whether_it_gave_up():
    assert not account_of([noticed(0)]).gave_up and account_of([noticed(None, "end")]).gave_up
    assert account_of([Stopped(None, "", False, True)]).gave_up


def test_what_was_noticed_in_time():
    assert account_of([noticed(0)]).noticed is None and account_of([noticed(0)]).replans == 1
    assert account_of([noticed(0, "go on")]).replans == 0
    assert account_of([placed(1), PUSHED, placed(2), noticed(0)]).noticed is True
    assert account_of([placed(1), PUSHED, placed(2), placed(3), noticed(0)]).noticed is False
    assert account_of([noticed(1), PUSHED, placed(2)]).noticed is False
    assert account_of([PUSHED]).disturbed is PUSHED
