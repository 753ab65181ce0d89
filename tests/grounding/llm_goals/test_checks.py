"""What a language model's goal leaves out of an instruction, or adds to it, is noticed."""

import pytest

from grounding.goal_reading.corrections import without_corrections
from grounding.goal_reading.reader import GoalReader
from grounding.llm_goals.checks import mismatch
from grounding.references.phrases import Vocabulary
from grounding.references.word_forms import FORMS

GRAMMAR = GoalReader()


def chunks(text):
    return without_corrections(GRAMMAR.chunks(text, Vocabulary(FORMS)))


def structure(shape, objects, **keys):
    return {"kind": "structure", "shape": shape, "objects": objects} | keys


def relation(name, objects, reference=None, **keys):
    return {"kind": "relation", "relation": name, "objects": objects, "reference": reference} | keys


CANS, CUPS, MUG, BOWL = ["the cans"], ["the cups"], ["the mug"], ["the bowl"]
TWO = "stack the cans on the left and put the cups in a circle of radius 15 cm around the bowl"
TALL = "line up the cans 5 cm apart by height, tallest on the left"
MOVE = "move the mug 10 cm to the left and put it next to the bowl"
RING = structure("circle", CUPS, radius=0.15, around=BOWL)
ORDER = {"by": "height", "direction": "descending", "from": "left"}


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (TWO, [structure("tower", CANS, x_position="left"), RING]),
        (TALL, [structure("line", CANS, order=ORDER, gap=0.05)]),
        (TALL, [structure("line", CANS, order={"by": "height", "direction": "ascending", "from": "right"}, gap=0.05)]),
        ("swap the mug and the bowl", [relation("swapped", ["the mug", "the bowl"])]),
        ("swap the mug and the bowl", [relation("swapped", ["the mug and the bowl"])]),
        ("put the mug left of the bowl, no, right of it", [relation("right of", MUG, BOWL)]),
        ("put the mug in the top right corner", [relation("at", MUG, x_position="right", y_position="top")]),
        ("sort everything by colour", [structure("cluster", None, group_by="colour")]),
        ("put everything except the bowl in a small ring", [structure("circle", ["everything except the bowl"], size="small")]),
        ("arrange the blocks in a 3 by 2 grid", [structure("grid", ["the blocks"], rows=3, columns=2)]),
        (
            "line up the cans behind the plate",
            [structure("line", CANS), relation("behind", {"part": 0}, ["the plate"])],
        ),
        (
            "put the bowl on the plate and the spoon in it",
            [relation("on", BOWL, ["the plate"]), relation("in", ["the spoon"], BOWL)],
        ),
        ("line up the cans and leave the bowl alone", [structure("line", CANS)]),
        (MOVE, [relation("moved", MUG, distance=0.1, direction="left"), relation("next to", MUG, BOWL)]),
    ],
)  # fmt: skip
def test_a_goal_that_says_what_was_said_has_no_mismatch(text, parts):
    assert mismatch(chunks(text), parts) == ""


@pytest.mark.parametrize(
    ("text", "parts", "what"),
    [
        (TWO, [structure("tower", CANS, x_position="left")], "leaves out the length 15 cm"),
        (TWO, [structure("tower", CANS, x_position="left"), structure("circle", CUPS, radius=0.15)], "'the bowl'"),
        (TWO, [RING], "leaves out 'the cans'"),
        (TWO, [structure("tower", CANS), RING], "leaves out x position left"),
        (TWO, [structure("tower", CANS, x_position="left", y_position="top"), RING], "y position top, which nobody"),
        (TWO, [structure("tower", CANS, x_position="left"), RING | {"radius": 0.2}], "leaves out the length 15 cm"),
        (TWO, [structure("line", CANS, x_position="left"), RING], "line that nobody"),
        (TWO, [structure("tower", CANS, x_position="left"), RING | {"shape": "arc"}], "leaves out the circle"),
        (TWO, [structure("tower", CANS, x_position="left"), RING | {"size": "large"}], "size large, which nobody"),
        (
            TWO, [structure("tower", CANS, x_position="left"), RING, relation("left of", BOWL, {"part": 0})],
            "'the bowl' once more",
        ),
        (TALL, [structure("line", CANS, gap=0.05)], "leaves out the order"),
        (TALL, [structure("line", CANS, order=ORDER)], "leaves out the length 5 cm"),
        (TALL, [structure("line", CANS, order=ORDER | {"from": "right"}, gap=0.05)], "another order"),
        (TALL, [structure("line", CANS, order=ORDER | {"by": "width"}, gap=0.05)], "order by width"),
        (MOVE, [relation("moved", MUG, distance=0.1, direction="right"), relation("next to", MUG, BOWL)], "direction of a move"),
        (MOVE, [relation("moved", MUG, distance=0.1, direction="left")], "leaves out 'the bowl'"),
        ("swap the mug and the bowl", [relation("next to", MUG, BOWL)], "leaves out a swap"),
        ("put the mug behind the bowl", [relation("in front of", MUG, BOWL)], "leaves out 'behind'"),
        ("put the mug left of the bowl, no, right of it", [relation("left of", MUG, BOWL)], "leaves out 'right of'"),
        ("sort everything by colour", [structure("cluster", None, group_by="kind")], "leaves out group by colour"),
        ("arrange the blocks in a 3 by 2 grid", [structure("grid", ["the blocks"], rows=2, columns=3)], "leaves out rows 3"),
        ("line up the cans along the front edge", [structure("line", CANS)], "leaves out along near"),
        ("put the mug and the fork in the bowl", [relation("in", MUG, BOWL)], "leaves out 'the fork'"),
        ("don't put the mug on the bowl", [relation("on", MUG, BOWL)], "forbids"),
        ("stack the cans, and never put the mug on the bowl", [structure("tower", CANS), relation("on", MUG, BOWL)], "forbids"),
        ("put the mug left of the bowl", [relation("left of", BOWL, MUG)], "anything 'left of' 'the bowl'"),
        ("put the mug on the plate and move it next to the bowl", [relation("on", MUG, BOWL), relation("next to", MUG, ["the plate"])], "'on' 'the plate'"),
        (
            "a circle of cups; a row of cans in front of it",
            [structure("circle", ["cups"]), structure("line", ["cans"]), relation("in front of", {"part": 0}, {"part": 1})],
            "the other way round",
        ),
        (
            "put the mug next to the bowl and keep it 6 cm from it",
            [relation("next to", MUG, BOWL), relation("next to", MUG, BOWL, distance=0.06)], "twice of the same",
        ),
        (
            "put the bowl on the plate and the spoon in the bowl",
            [relation("on", ["the spoon"], ["the plate"]), relation("in", ["the spoon"], BOWL)], "leaves out 'the bowl'",
        ),
    ],
)  # fmt: skip
def test_what_is_left_out_or_added_is_named(text, parts, what):
    assert what in mismatch(chunks(text), parts)


def test_an_order_from_one_side_to_the_other_begins_where_it_is_said():
    text = "line everything up from the shortest to the tallest, left to right"
    line = {"kind": "structure", "shape": "line", "objects": ["everything"]}
    rising = line | {"order": {"by": "height", "direction": "ascending", "from": "left"}}
    assert not mismatch(chunks(text), [rising])
    same = line | {"order": {"by": "height", "direction": "descending", "from": "right"}}
    assert not mismatch(chunks(text), [same])
    for start, way in (("left", "descending"), ("right", "ascending"), (None, "ascending")):
        other = line | {"order": {"by": "height", "direction": way, "from": start}}
        assert "another order" in mismatch(chunks(text), [other]), (start, way)


def test_a_structure_has_its_place_itself():
    text = "put the cups in a circle at the back"
    circle = {"kind": "structure", "shape": "circle", "objects": ["the cups"]}
    assert not mismatch(chunks(text), [circle | {"y_position": "top"}])
    apart = {"kind": "relation", "relation": "at", "objects": {"part": 0}, "y_position": "top"}
    assert "apart from its other keys" in mismatch(chunks(text), [circle, apart])


@pytest.mark.parametrize(
    "text",
    [
        "make a triangle with the other things, except the cup",
        "make a triangle with everything, but not with the cup",
        "make a triangle with everything and leave the cup alone",
    ],
)
def test_what_is_excepted_is_not_in_everything(text):
    triangle = structure("triangle", None)
    assert "may move" in mismatch(chunks(text), [triangle])
