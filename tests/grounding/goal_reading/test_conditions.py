"""A wish that depends on something, or is put off, is not built as if it did not."""

import pytest

from tests.grounding.goal_reading.test_reader import SCENES, interpreter  # noqa: F401


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("if the red can is empty, stack the cans", "if"), ("stack the cans only if they are empty", "only if"),
        ("when I clap, stack the cans", "when"), ("stack the cans until I say stop", "until"), ("stack the cans tomorrow", "tomorrow"),
        ("stack the cans in five minutes", "in five minutes"), ("stack the cans every hour", "every hour"),
    ],
)  # fmt: skip
def test_conditions_and_times_are_refused(interpreter, text, words):  # noqa: F811
    found = interpreter.interpret(text, SCENES["cans and cups"])
    assert found.status == "refused" and repr(words) in found.message


@pytest.mark.parametrize(
    "text",
    [
        "if there is enough room, stack the cans", "stack the cans as long as the white cup stays where it is",
        "My sister comes in five minutes, so stack the cans.", "stack the cans, if that makes sense",
        "stack the cans before my guests arrive", "it would look nicer if the cans were in a tower",
    ],
)  # fmt: skip
def test_what_is_no_condition_of_the_wish(interpreter, text):  # noqa: F811
    found = interpreter.interpret(text, SCENES["cans and cups"])
    assert found.status == "ok" and [part.objects for part in found.goal.parts] == [(0, 1, 2)]


@pytest.mark.parametrize("text", ["line up the clean ones", "put the round things in a row"])
def test_objects_that_nothing_tells_apart_are_not_everything(interpreter, text):  # noqa: F811
    found = interpreter.interpret(text, SCENES["cans and cups"])
    assert found.status == "refused" and "not known" in found.message
