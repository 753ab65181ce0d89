"""Verbs of placing are read in all their forms, and verbs of other work are never dropped."""

import pytest

from tests.grounding.goal_reading.test_reader import SCENES, interpreter  # noqa: F401

ON_PLATE = [("on", (5,), (3,))]


def relations(interpreter, text, scene="breakfast"):  # noqa: F811
    found = interpreter.interpret(text, SCENES[scene])
    assert found.status == "ok", found.message
    return [(part.relation, part.objects, part.reference) for part in found.goal.parts]


@pytest.mark.parametrize(
    "text",
    [
        "plop the banana on the plate", "the banana is to be laid on the plate", "make the banana sit on the plate",
        "pick the banana up and set it down on the plate", "have the banana lying on the plate",
        "the banana is supposed to be on the plate", "the banana ought to end up on the plate", "I want to find the banana on the plate",
        "don't leave the banana in the bowl, put it on the plate", "the banana wants putting on the plate",
    ],
)  # fmt: skip
def test_forms_of_placing(interpreter, text):  # noqa: F811
    assert relations(interpreter, text) == ON_PLATE


def test_a_tool_on_the_table_is_no_verb_before_a_place(interpreter):  # noqa: F811
    assert relations(interpreter, "hammer in the box", "workshop") == [("in", (0,), (5,))]
    assert "asks for other work" in interpreter.interpret("hammer the box", SCENES["workshop"]).message


@pytest.mark.parametrize("text", ["swap the mugs around", "swap the two mugs round would you", "the mugs: trade places"])
def test_forms_of_swapping(interpreter, text):  # noqa: F811
    assert relations(interpreter, text) == [("swapped", (0, 1), None)]


@pytest.mark.parametrize(
    ("text", "verb"),
    [
        ("clean the mugs and line them up", "clean"), ("peel the banana and place it on the plate", "peel"),
        ("put the mugs in a row and dance", "dance"), ("pass me the spoon and stack the mugs", "pass"),
        ("throw the banana on the plate", "throw"), ("open the bowl and put the spoon in it", "open"),
    ],
)  # fmt: skip
def test_other_work_is_refused_by_name(interpreter, text, verb):  # noqa: F811
    found = interpreter.interpret(text, SCENES["breakfast"])
    assert found.status == "refused" and not found.goal.parts and repr(verb) in found.message


def test_adjectives_that_are_verbs_too_ask_for_no_work(interpreter):  # noqa: F811
    found = interpreter.interpret("clean mugs in a row on the left", SCENES["breakfast"])
    assert found.status == "ok" and found.goal.parts[0].shape == "line"
