"""The sentences of the default parser's further development, and those that were kept unseen, are read no worse than measured."""

from importlib import resources

import pytest

from grounding.benchmark import development_rows, free_rows, five_slots, is_exact, load_rows
from grounding.goal_network.writer import NetworkWriter
from grounding.interpreter import Interpreter
from grounding.parse_result import Parse, Question
from grounding.slot_corrections import with_plain_words
from grounding.spec import StructureSpec


@pytest.fixture(scope="module")
def interpreter(encoder, parser):
    return Interpreter(lambda: parser, None, "robot", encoder, network=lambda: NetworkWriter.from_pretrained(encoder))


def _rows(name):
    with resources.as_file(resources.files("grounding") / "benchmark_data" / f"{name}.jsonl") as path:
        return load_rows(path)


@pytest.mark.parametrize(("name", "count", "exact"), [("development_b", 393, 362), ("held_out", 72, 65)])
def test_as_many_sentences_as_measured_are_exact(interpreter, name, count, exact):
    rows = _rows(name)
    found = interpreter.interpret_many([row.text for row in rows])
    read = (five_slots(one.parse, one.status, one.goal) for one in found)
    assert len(rows) == count
    assert sum(is_exact(row, one) for row, one in zip(rows, read, strict=True)) >= exact


def test_no_sentence_stands_in_two_files():
    texts = [row.text for row in (*free_rows(), *development_rows(), *_rows("development_b"), *_rows("held_out"))]
    assert len(set(texts)) == len(texts)


@pytest.mark.parametrize(
    ("text", "read", "corrected"),
    [
        ("a circle , centre left", {"shape": "circle", "x_position": "center"}, {"x_position": "left", "y_position": "middle"}),
        ("a line , but not so small", {"shape": "line", "size": "small"}, {"size": "medium"}),
        ("why don't you make a small ring", {"shape": "circle", "size": "small"}, {}),
        ("not the small ring , a large one", {"shape": "circle", "size": "large"}, {}),
        ("nice apples , right ? stack them", {"shape": "tower", "x_position": "right"}, {"x_position": None}),
        ("on the right , right ? a stack", {"shape": "tower", "x_position": "right"}, {}),
        ("only four are left ; line them up", {"shape": "line", "x_position": "left"}, {"x_position": None}),
        ("only four are left ; line them up on the left", {"shape": "line", "x_position": "left"}, {}),
        ("a row of cans going away from me", {"shape": "line", "rotation": "north"}, {"rotation": "east"}),
        ("a row facing away from me", {"shape": "line", "rotation": "north"}, {}),
        ("a ring facing up the table", {"shape": "circle"}, {"rotation": "north"}),
        ("from my seat , on the right", {"x_position": "right", "y_position": "bottom"}, {"y_position": None}),
        ("from my seat , in the front", {"y_position": "bottom"}, {}),
        ("a stack on the side that the arm is on", {"shape": "tower"}, {"y_position": "bottom"}),
        ("put them on the table top", {"y_position": "top"}, {"y_position": None}),
    ],
)
def test_plain_words_correct_the_slot_that_they_speak_of(text, read, corrected):
    spec = StructureSpec(**read)
    found = with_plain_words(text, Parse(text, spec, "p"))
    assert found.spec == StructureSpec(**{**read, **corrected})


def test_a_slot_that_plain_words_settle_is_not_asked_about():
    question = Question("size", "how big?", ("small", "large"))
    parse = Parse("t", StructureSpec("line", "large"), "p", "ask", question.text, question=question)
    assert with_plain_words("a row , not so large", parse).status == "ok"
    assert with_plain_words("a row", parse).status == "ask"


@pytest.mark.parametrize(
    ("text", "slots"),
    [
        ("The cans arrived in a large crate; make a row of them at the back.", ("line", None, None, "top", None)),
        ("Could the cans stand like a fence at the back?", ("line", None, None, "top", None)),
        ("Wouldn't it be lovely if the candles encircled an empty spot?", ("circle", None, None, None, None)),
        ("I'd have done it if it weren't for my bad knee. The forks in a row, facing me.", ("line", None, None, None, "south")),
        ("It isn't urgent, but whenever you find a minute stack the boxes on the left", ("tower", None, "left", None, None)),
        ("The line of cups should be a short one at the back right", ("line", "small", "right", "top", None)),
        ("make acircle ont he left", ("circle", None, "left", None, None)),
    ],
)
def test_what_asks_for_nothing_keeps_nothing_from_being_built(interpreter, text, slots):
    found = interpreter.interpret(text)
    spec = five_slots(found.parse, found.status, found.goal).spec
    assert found.status == "ok"
    assert (spec.shape, spec.size, spec.x_position, spec.y_position, spec.rotation) == slots


def test_what_two_readers_leave_out_of_their_goal_is_remarked(interpreter):
    found = interpreter.interpret("The sun is in the south and dazzles me, so have the glasses on the left.")
    assert found.status == "ok"
    assert "'sun'" in found.message


@pytest.mark.parametrize(
    "text",
    [
        "is there room for a circle on the left?",
        "put the cups in a circle if the plate is empty",
        "could you put the cups in a row every day",
        "stack the cups until I clap",
    ],
)
def test_questions_and_conditions_stay_refused(interpreter, text):
    assert interpreter.interpret(text).status == "refused"
