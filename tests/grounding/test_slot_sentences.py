"""The sentences of the default parser's further development, and those that were kept unseen,
are read no worse than measured.
"""

from importlib import resources

import pytest

from grounding.benchmark import development_rows, five_slots, free_rows, is_exact, load_rows


def _rows(name):
    with resources.as_file(resources.files("grounding") / "benchmark_data" / f"{name}.jsonl") as path:
        return load_rows(path)


UNSEEN = pytest.mark.xfail(reason="the verifier does not see it yet", strict=False)


@pytest.mark.parametrize(("name", "every", "count", "exact"), [("development_b", 3, 131, 120), ("held_out", 1, 72, 62)])
def test_as_many_sentences_as_measured_are_exact(interpreter, name, every, count, exact):
    rows = _rows(name)[::every]
    found = interpreter.interpret_many([row.text for row in rows])
    read = (five_slots(one.parse, one.status, one.goal, one.choices) for one in found)
    assert len(rows) == count
    assert sum(is_exact(row, one) for row, one in zip(rows, read, strict=True)) >= exact


def test_no_sentence_stands_in_two_files():
    texts = [row.text for row in (*free_rows(), *development_rows(), *_rows("development_b"), *_rows("held_out"))]
    assert len(set(texts)) == len(texts)


@pytest.mark.parametrize(
    ("text", "slots"),
    [
        ("The cans arrived in a large crate; make a row of them at the back.", ("line", None, None, "top", None)),
        ("Could the cans stand like a fence at the back?", ("line", None, None, "top", None)),
        ("Wouldn't it be lovely if the candles encircled an empty spot?", ("circle", None, None, None, None)),
        (
            "I'd have done it if it weren't for my bad knee. The forks in a row, facing me.",
            ("line", None, None, None, "south"),
        ),
        (
            "It isn't urgent, but whenever you find a minute stack the boxes on the left",
            ("tower", None, "left", None, None),
        ),
        ("The line of cups should be a short one at the back right", ("line", "small", "right", "top", None)),
        ("make acircle ont he left", ("circle", None, "left", None, None)),
    ],
)
def test_what_asks_for_nothing_keeps_nothing_from_being_built(interpreter, text, slots):
    found = interpreter.interpret(text)
    spec = five_slots(found.parse, found.status, found.goal).spec
    assert found.status == "ok"
    assert (spec.shape, spec.size, spec.x_position, spec.y_position, spec.rotation) == slots


def test_what_is_left_out_of_a_goal_is_remarked(interpreter):
    found = interpreter.interpret("The sun is in the south and dazzles me, so have the glasses on the left.")
    assert found.status == "ok"
    assert "'dazzles'" in found.message


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("is there room for a circle on the left?", marks=UNSEEN),
        "put the cups in a circle if the plate is empty",
        "could you put the cups in a row every day",
        pytest.param("stack the cups until I clap", marks=UNSEEN),
    ],
)
def test_questions_and_conditions_stay_refused(interpreter, text):
    assert interpreter.interpret(text).status == "refused"
