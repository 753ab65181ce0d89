"""Care, manners, openers and comments do not change what is built; what they hold beside it is not lost."""

import pytest

from tests.grounding.goal_reading.test_reader import SCENES, interpreter  # noqa: F401


@pytest.mark.parametrize(
    "text",
    [
        "put the banana on the plate, mind the mugs", "put the banana on the plate without knocking over the mugs",
        "put the banana on the plate and don't let it fall", "put the banana on the plate, nice and slow",
        "put the banana on the plate as gently as you can", "put the banana on the plate, honey",
        "why don't you put the banana on the plate", "start by putting the banana on the plate", "feel free to put the banana on the plate",
        "my wife wants the banana on the plate", "task: put the banana on the plate", "put the banana on, uh, the plate",
        "put the banana on the plate and tell me when you're done", "the banana can't stay there, it should go on the plate",
        "the banana keeps rolling off the table, so put it on the plate", "the banana looks lonely, put it on the plate",
        "sorry to bother you again but could you put the banana on the plate", "put the banana on the plate, guests are coming",
    ],
)  # fmt: skip
def test_what_asks_for_nothing_else(interpreter, text):  # noqa: F811
    found = interpreter.interpret(text, SCENES["breakfast"])
    assert found.status == "ok", found.message
    assert [(part.relation, part.objects, part.reference) for part in found.goal.parts] == [("on", (5,), (3,))]


def test_care_for_an_object_of_a_structure_leaves_it_in(interpreter):  # noqa: F811
    found = interpreter.interpret("line up the cups, be careful with the red one", SCENES["cans and cups"])
    assert found.goal.parts[0].objects == (3, 4, 5, 6)


def test_what_stays_put_is_left_out(interpreter):  # noqa: F811
    found = interpreter.interpret("put everything in a circle, the cans stay put", SCENES["cans and cups"])
    assert found.goal.parts[0].objects == (3, 4, 5, 6)


@pytest.mark.parametrize(
    ("text", "shape"),
    [
        ("I don't want the cups in a row, I want them in a circle", "circle"), ("don't stack the cups, line them up", "line"),
        ("don't build a tower, lay the cups in a row instead", "line"),
        ("don't put the cups in a row, put the cups in a square", "square"),
    ],
)  # fmt: skip
def test_denials_that_are_replaced(interpreter, text, shape):  # noqa: F811
    found = interpreter.interpret(text, SCENES["cans and cups"])
    assert found.goal.parts[0].shape == shape and len(found.goal.parts) == 1


def test_a_denial_alone_is_refused(interpreter):  # noqa: F811
    assert interpreter.interpret("don't put the cups on the left", SCENES["cans and cups"]).status == "refused"
