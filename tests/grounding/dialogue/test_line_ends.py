"""Objects at an end of a line or a tower, as corrections ask for them."""

import pytest

from grounding.dialogue.revise_goal import revise_goal
from grounding.dialogue.scene_reader import SceneReader
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.interpreter import Interpreter
from grounding.references.attributes import SceneObject

NAMES = ("red cup", "blue cup", "green cup", "plate", "bowl", "banana")
OBJECTS = [SceneObject(name) for name in NAMES]
FROM_LEFT = {"by": "listed", "from": "left"}
BY_HEIGHT = {"by": "height", "direction": "ascending", "from": "left"}


def structure(objects, order=None, shape="line", **keys):
    return {"kind": "structure", "shape": shape, "objects": objects, "order": order, **keys}


def listed(start=None):
    return {"by": "listed", "from": start}


LINE, LISTED = structure([0, 1, 2]), structure([0, 1, 2], FROM_LEFT)
TOWER = structure([0, 1, 2], shape="tower")


@pytest.fixture
def say(parser, encoder):
    interpreter = Interpreter(lambda: parser, None, "robot", encoder)

    def revised(part, text):
        last = Goal.from_dict({"parts": [part]})
        return revise_goal(last, text, SceneReader(interpreter, OBJECTS), OBJECTS, encoder=encoder)

    return revised


@pytest.mark.parametrize(
    ("part", "text", "then"),
    [
        (LINE, "add the bowl at the right end", structure([0, 1, 2, 4], FROM_LEFT)),
        (LINE, "the bowl goes on the left end of the row", structure([4, 0, 1, 2], FROM_LEFT)),
        (LINE, "put the bowl at the near end of the line", structure([4, 0, 1, 2], listed("near"))),
        (LINE, "then the bowl at the end of it, please", structure([0, 1, 2, 4], listed())),
        (LISTED, "at the right end comes the bowl", structure([0, 1, 2, 4], FROM_LEFT)),
        (LISTED, "the red cup should be last", structure([1, 2, 0], FROM_LEFT)),
        (LISTED, "move the red cup to the other end of the line", structure([1, 2, 0], FROM_LEFT)),
        (LISTED, "green cup first", structure([2, 0, 1], FROM_LEFT)),
        (LISTED, "bowl and banana at the end", structure([0, 1, 2, 4, 5], FROM_LEFT)),
        (LISTED, "green cup leftmost", structure([2, 0, 1], FROM_LEFT)),
        (LISTED, "the red cup in the middle of the line", structure([1, 0, 2], FROM_LEFT)),
        (LISTED, "green cup between the other two", structure([0, 2, 1], FROM_LEFT)),
        (TOWER, "put the plate at the very bottom", structure([3, 0, 1, 2], listed("bottom"), "tower")),
    ],
)
def test_an_object_at_an_end(say, part, text, then):
    found = say(part, text)
    assert found.status == "ok", found.message
    assert compare_goals(found.goal, Goal.from_dict({"parts": [then]}), len(NAMES)).exact, found.goal


def test_an_order_that_nobody_gave_is_told(say):
    assert "red cup, blue cup, green cup, bowl" in say(LINE, "put the bowl at the end of the line").message


@pytest.mark.parametrize(
    ("part", "text", "reason"),
    [
        (LISTED, "put the bowl at the far end", "no such end: its order is given from left"),
        (LISTED, "put the bowl in the middle of it", "even number"),
        (structure([0, 1, 2], BY_HEIGHT), "put the bowl at the right end", "ordered by height"),
    ],
)
def test_an_end_that_the_order_does_not_leave_free(say, part, text, reason):
    found = say(part, text)
    assert (found.status, found.goal) == ("refused", Goal.from_dict({"parts": [part]}))
    assert reason in found.message


def test_which_other_end_is_asked(say):
    found = say(LINE, "and the bowl at the other end")
    assert found.status == "ask"
    ends = {(each.parts[0].order.start, each.parts[0].objects[0]) for each in found.choices}
    assert ends == {("left", 4), ("right", 4)}


def test_the_end_it_has_already_changes_nothing(say):
    assert say(LISTED, "the green cup should be last").status == "unchanged"


def test_a_circle_has_no_ends(say):
    circle = structure([0, 1, 2], shape="circle")
    found = say(circle, "put the bowl at the end")
    assert found.status != "ok" or found.goal.parts[0].order is None
