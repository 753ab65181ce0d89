"""Wishes that the slots cannot hold: refused or asked about, and never bent into a slot."""

import json
from pathlib import Path

import pytest

from grounding.interpreter import Interpreter

DATA = Path(__file__).parents[2] / "grounding" / "benchmark_data"


@pytest.fixture(scope="module")
def interpreter(parser, encoder) -> Interpreter:
    return Interpreter(lambda: parser, encoder=encoder)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("stack the cans, tallest at the bottom", "an order of the objects ('tallest at the bottom')"),
        ("stack them, biggest first", "an order"),
        ("line up the cups with the smallest one on the left", ""),
        ("line up the books like on a shelf, tallest left", "an order of the objects ('tallest left')"),
        ("make a tower of cans with the red one on top", "a place of one object within the structure"),
        ("stack everything with the green block on top.", ""),
        ("put the cups in a circle with the bowl in the middle", "a place of one object within the structure"),
        ("a tower with the mug on top of the cans", "a place next to single objects ('on top of the cans')"),
        ("stack the mug on the plate", ""),
        ("table setting with the cup on the left", "a place of one object"),
        ("alternate cups and bowls in a line", "an order of the objects ('alternate')"),
        ("line the blocks up in order from left to right, red, green, blue", ""),
        ("put the cups upside down in a line", "how single objects are turned ('upside down')"),
        ("cups in a line, handles to the left", "how single objects are turned"),
        ("put everything in a line, 5 cm apart", ""),
        ("make a tower half a metre high", ""),
        ("put the cups in a line to the left of the bowl", ""),
    ],
)
def test_what_cannot_be_built_is_refused(interpreter, text, what):
    parse = interpreter.parse(text)
    assert parse.status == "refused" and parse.spec.tokens() == ()
    assert what in parse.message and repr(text[:20])[1:-1] in parse.message


@pytest.mark.parametrize(
    ("text", "slot", "options"),
    [
        ("line along the front edge", "y_position", ("bottom", "open")),
        ("put the cups in a line along the front edge", "y_position", ("bottom", "open")),
        ("line the mugs up along the left edge", "x_position", ("left", "open")),
        ("spread the cups out evenly along the front edge", "y_position", ("bottom", "open")),
        ("cups in the corner", "corner", ("front left", "front right", "back left", "back right")),
        ("stack the cans in a corner", "corner", ("front left", "front right", "back left", "back right")),
        ("put the cups in the left corner", "y_position", ("top", "bottom")),
        ("in the far corner make a circle", "x_position", ("left", "right")),
    ],
)
def test_edges_and_corners_are_asked_about(interpreter, text, slot, options):
    parse = interpreter.parse(text)
    assert parse.status == "ask" and parse.question.slot == slot and parse.question.options == options
    assert parse.message == parse.question.text


@pytest.mark.parametrize(
    ("text", "tokens"),
    [
        (
            "put the cups in a circle in the top left corner",
            {"shape": "circle", "x_position": "left", "y_position": "top"},
        ),
        ("put the tallest cans in a line on the left", {"shape": "line", "x_position": "left"}),
        ("make a line with the cups on the left", {"shape": "line", "x_position": "left"}),
        ("put the cups in a circle in the middle of the table", {"shape": "circle", "y_position": "middle"}),
        ("make the smallest possible circle on the left", {"shape": "circle", "size": "small", "x_position": "left"}),
        ("stack the cups on top of each other", {"shape": "tower"}),
        ("pile the books on the desk", {"shape": "tower"}),
        ("put the cups in a line left of center", {"shape": "line", "x_position": "left"}),
        ("line up the cups on the right of the table", {"shape": "line", "x_position": "right"}),
        # how a line runs, and the table's top
        (
            "put all the blocks in a horizontal line on the left",
            {"shape": "line", "x_position": "left", "rotation": "north"},
        ),
        ("put the blocks in a vertical line", {"shape": "line", "rotation": "east"}),
        ("arrange 4 red blocks in a vertical stack on the table top", {"shape": "tower"}),
    ],
)
def test_what_can_be_built_is_left_alone(interpreter, text, tokens):
    parse = interpreter.parse(text)
    assert (parse.status, dict(parse.spec.tokens())) == ("ok", tokens)


def test_no_buildable_instruction_of_the_benchmark_is_refused_for_it(interpreter):
    """The best reading of a question counts, so that only a refusal could lose one."""
    rows = [json.loads(line) for name in ("free", "development") for line in (DATA / f"{name}.jsonl").open()]
    buildable = [row["text"] for row in rows if not row["refuse"]]
    refused = [
        parse.text
        for parse in interpreter.parse_batch(buildable)
        if "cannot be built yet" in parse.message and parse.status == "refused"
    ]
    assert refused == []
