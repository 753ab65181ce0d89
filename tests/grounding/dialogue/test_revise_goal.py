"""Corrections of goals of several parts: which part a sentence means, what it changes there, and what it leaves alone."""

import pytest

from grounding.dialogue.goal_changes import only_parts, without_parts
from grounding.dialogue.goal_revision import PART
from grounding.dialogue.revise_goal import revise_goal
from grounding.dialogue.scene_reader import SceneReader
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.interpreter import Interpreter
from grounding.references.attributes import SceneObject
from grounding.spec import StructureSpec

NAMES = ("red cup", "blue cup", "green cup", "plate", "bowl", "banana", "tall can", "small can", "apple")
OBJECTS = [SceneObject(name) for name in NAMES]


def structure(shape, objects, **keys):
    return {"kind": "structure", "shape": shape, "objects": objects, **keys}


def relation(name, objects, reference=None, **keys):
    return {"kind": "relation", "relation": name, "objects": objects, "reference": reference, **keys}


def with_(parts, number, **keys):
    return [part | keys if place == number else part for place, part in enumerate(parts)]


TWO = [structure("tower", [6, 7], x_position="left"), structure("circle", [0, 1, 2], x_position="right")]
ROW = [structure("line", [0, 1, 2]), relation("left of", [4], {"part": 0})]
FRUIT = [relation("next to", [5], [1]), relation("on", [8], [3])]
GAPS = [structure("line", [0, 1, 2], gap=0.05, x_position="left")]
MOVED = [relation("moved", [0], direction="left", distance=0.10)]
CORNERS = [relation("at", [4], x_position="left"), relation("at", [3], x_position="right")]
SIDES = [structure("line", [0, 1, 2], x_position="left"), structure("tower", [6, 7], x_position="right")]
SWAPPED = [relation("swapped", [0, 5]), relation("at", [4], x_position="right")]
LINE = [structure("line", [0, 1, 2])]


def goal(parts):
    return Goal.from_dict({"parts": parts})


@pytest.fixture
def say(parser, encoder):
    """Revise a goal; what is said comes from the robot's side, or from across the table."""
    interpreters = {side: Interpreter(lambda: parser, None, side, encoder) for side in ("robot", "opposite")}

    def revised(parts, text, viewpoint="robot", **more):
        reader = SceneReader(interpreters[viewpoint], OBJECTS)
        return revise_goal(goal(parts), text, reader, OBJECTS, encoder=encoder, **more)

    return revised


@pytest.mark.parametrize(
    ("last", "text", "then"),
    [
        (TWO, "drop the circle, keep the tower", TWO[:1]),
        (TWO, "make the circle bigger", with_(TWO, 1, size="large")),
        (TWO, "the other side", "ask"),
        (TWO, "swap sides", with_(with_(TWO, 0, x_position="right"), 1, x_position="left")),
        (ROW, "put the bowl on the other side", with_(ROW, 1, relation="right of")),
        (TWO, "put the tower behind the circle", [*TWO, relation("behind", {"part": 0}, {"part": 1})]),
        (TWO, "the circle should be to the left of the tower", [*TWO, relation("left of", {"part": 1}, {"part": 0})]),
        (ROW, "bowl in front then", with_(ROW, 1, relation="in front of")),
        (ROW, "the bowl at the front edge of the table", [ROW[0], relation("at", [4], y_position="bottom")]),
        (TWO, "lose the blue cup from the circle", with_(TWO, 1, objects=[0, 2])),
        (ROW, "make the line longer", with_(ROW, 0, size="large")),
        (GAPS, "5 cm more", with_(GAPS, 0, gap=0.10)),
        (MOVED, "5 cm more", with_(MOVED, 0, distance=0.15)),
        (MOVED, "no, to the right", with_(MOVED, 0, direction="right")),
        (FRUIT, "no, the red one", with_(FRUIT, 0, reference=[0])),
        (FRUIT, "also put the tall can next to the plate", [*FRUIT, relation("next to", [6], [3])]),
        (FRUIT, "put the apple in the bowl instead", [FRUIT[0], relation("in", [8], [4])]),
        (TWO, "leave the cups where they are", TWO[:1]),
        (TWO, "the second one on the left instead", with_(TWO, 1, x_position="left")),
        (CORNERS, "swap them", with_(with_(CORNERS, 0, x_position="right"), 1, x_position="left")),
        (TWO, "make it purple", "refused"),
        (LINE, "swap the red cup and the green cup", "refused"),
        (FRUIT, "take the apple off the plate", FRUIT[:1]),
        (FRUIT[1:], "take the apple off the plate", "refused"),
        (FRUIT[:1], "never mind the blue cup, put it in the bowl", [relation("in", [5], [4])]),
        (LINE, "no green cup, but the bowl", [structure("line", [0, 1, 4])]),
        (LINE, "make a second line with the rest", [*LINE, structure("line", None)]),
        (TWO, "add the bowl to the circle", with_(TWO, 1, objects=[0, 1, 2, 4])),
        (TWO, "make the tower a line", with_(TWO, 0, shape="line")),
        (GAPS, "gaps of 10 cm", with_(GAPS, 0, gap=0.10)),
        (TWO, "drop it", "ask"),
        (TWO, "part 2 smaller", with_(TWO, 1, size="small")),
        (TWO, "put the tower in the center", with_(TWO, 0, x_position="center")),
        (TWO, "move the tower to the back", with_(TWO, 0, y_position="top")),
        (TWO, "bigger", with_(TWO, 1, size="large")),
        (TWO, "further left", "ask"),
        (TWO, "both smaller", "refused"),
        (TWO, "put both at the back", with_(with_(TWO, 0, y_position="top"), 1, y_position="top")),
        (TWO, "swap the circle and the tower", with_(with_(TWO, 0, x_position="right"), 1, x_position="left")),
        (TWO, "only the circle", TWO[1:]),
        (TWO, "keep only part 1", TWO[:1]),
        (TWO, "remove the green cup", with_(TWO, 1, objects=[0, 1])),
        (TWO, "use the bowl instead of the green cup", with_(TWO, 1, objects=[0, 1, 4])),
        (TWO, "no tower", TWO[1:]),
        (TWO, "forget about both", "refused"),
        (TWO, "and the banana", "ask"),
        (TWO, "also add the banana to the circle", with_(TWO, 1, objects=[0, 1, 2, 5])),
        (TWO, "5 cm more", "refused"),
        (TWO, "the circle should have a radius of 15 cm", with_(TWO, 1, radius=0.15)),
        (TWO, "radius 12 cm", with_(TWO, 1, radius=0.12)),
        (TWO, "move the cups to the left", with_(TWO, 1, x_position="left")),
        (TWO, "make the tower taller", "refused"),
        (TWO, "the line on the left", "refused"),
        (TWO, "put the cups in the circle closer together", with_(TWO, 1, size="small")),
        (TWO, "turn the first one into a line", with_(TWO, 0, shape="line")),
        (TWO, "the left one in the center please", with_(TWO, 0, x_position="center")),
        (TWO, "leave the tall can alone", with_(TWO, 0, objects=[7])),
        (TWO, "don't build the tower", TWO[1:]),
        (TWO, "I don't want the circle any more", TWO[:1]),
        (TWO, "the tower can go", TWO[1:]),
        (TWO, "just the tower please", TWO[:1]),
        (TWO, "drop the line", "refused"),
        (TWO, "make the circle purple", "refused"),
        (TWO, "drop the circle and dance", "refused"),
        (TWO, "make the circle bigger and put the tower in the center",
         with_(with_(TWO, 1, size="large"), 0, x_position="center")),
        (ROW, "behind it instead", with_(ROW, 1, relation="behind")),
        (ROW, "put the bowl behind the line", with_(ROW, 1, relation="behind")),
        (ROW, "10 cm away", with_(ROW, 1, distance=0.10)),
        (ROW, "leave 10 cm between them", "ask"),
        (ROW, "drop the line", "refused"),
        (ROW, "drop the bowl", ROW[:1]),
        (ROW, "the plate instead of the bowl", with_(ROW, 1, objects=[3])),
        (ROW, "make it longer", with_(ROW, 0, size="large")),
        (ROW, "turn the line by 90 degrees", "ask"),
        (ROW, "on the right of it", with_(ROW, 1, relation="right of")),
        (ROW, "put it on the right of the line", with_(ROW, 1, relation="right of")),
        (ROW, "make the line a circle", with_(ROW, 0, shape="circle")),
        (ROW, "move the bowl to the other side of the line", with_(ROW, 1, relation="right of")),
        (FRUIT, "the banana on the other side", "refused"),
        (FRUIT, "put the banana left of the blue cup instead", with_(FRUIT, 0, relation="left of")),
        (FRUIT, "the apple in the bowl instead", [FRUIT[0], relation("in", [8], [4])]),
        (FRUIT, "not the apple, the small can", with_(FRUIT, 1, objects=[7])),
        (FRUIT, "the green cup instead of the blue one", with_(FRUIT, 0, reference=[2])),
        (FRUIT, "drop the banana", FRUIT[1:]),
        (FRUIT, "leave the apple where it is", FRUIT[:1]),
        (FRUIT, "bigger", "refused"),
        (FRUIT, "no, behind the blue cup", with_(FRUIT, 0, relation="behind")),
        (FRUIT, "swap the apple and the banana", [relation("next to", [8], [1]), relation("on", [5], [3])]),
        (GAPS, "half as far apart", with_(GAPS, 0, gap=0.025)),
        (GAPS, "twice the gap", with_(GAPS, 0, gap=0.10)),
        (GAPS, "make the gaps smaller", "refused"),
        (GAPS, "3 inches apart", with_(GAPS, 0, gap=0.0762)),
        (GAPS, "radius 10 cm", "refused"),
        (GAPS, "1e9 cm apart", "refused"),
        (GAPS, "make it 40 cm long", with_(GAPS, 0, length=0.4)),
        (GAPS, "put it on the right", with_(GAPS, 0, x_position="right")),
        (GAPS, "make it a circle", with_(GAPS, 0, shape="circle")),
        (GAPS, "-3 cm apart", "refused"),
        (MOVED, "to the right instead", with_(MOVED, 0, direction="right")),
        (MOVED, "10 cm to the right instead", with_(MOVED, 0, direction="right")),
        (MOVED, "the blue one, not the red one", with_(MOVED, 0, objects=[1])),
        (MOVED, "twice as far", with_(MOVED, 0, distance=0.2)),
        (MOVED, "5 cm less", with_(MOVED, 0, distance=0.05)),
        (MOVED, "towards me", with_(MOVED, 0, direction="closer")),
        (MOVED, "20 cm less", "refused"),
        (MOVED, "make it dance", "refused"),
        (CORNERS, "the bowl at the back", with_(CORNERS, 0, y_position="top")),
        (CORNERS, "put the plate in the top right corner", with_(CORNERS, 1, y_position="top")),
        (CORNERS, "the other way round", with_(with_(CORNERS, 0, x_position="right"), 1, x_position="left")),
        (CORNERS, "wrong way round, swap them", with_(with_(CORNERS, 0, x_position="right"), 1, x_position="left")),
        (SIDES, "swap the cups and the cans", with_(with_(SIDES, 0, x_position="right"), 1, x_position="left")),
        (SIDES, "swap the cans with the cups", with_(with_(SIDES, 0, x_position="right"), 1, x_position="left")),
        (SIDES, "the lot at the back", [part | {"y_position": "top"} for part in SIDES]),
        (SIDES, "plate at the very back", [*SIDES, relation("at", [3], y_position="top")]),
        (FRUIT, "the tall can next to it", [*FRUIT, relation("next to", [6], [3])]),
        (SWAPPED, "red cup in the bowl", "refused"),
        (GAPS, "now a circle", with_(GAPS, 0, shape="circle")),
        (CORNERS, "change places", with_(with_(CORNERS, 0, x_position="right"), 1, x_position="left")),
        (TWO, "make the second one small", with_(TWO, 1, size="small")),
        (TWO, "the second at the front, please", with_(TWO, 1, y_position="bottom")),
        (TWO, "the latter in front", with_(TWO, 1, y_position="bottom")),
        (TWO, "only the first", TWO[:1]),
        (TWO, "make them lines", [part | {"shape": "line"} for part in TWO]),
        (TWO, "lines instead of circles", with_(TWO, 1, shape="line")),
        (CORNERS, "would you also put the apple on the plate", [*CORNERS, relation("on", [8], [3])]),
    ],
)  # fmt: skip
def test_corrections(say, last, text, then):
    revision = say(last, text)
    if isinstance(then, str):
        assert (revision.status in ("refused", "unchanged")) if then == "refused" else (revision.status == "ask")
        assert revision.message and revision.goal == goal(last)
        return
    assert revision.status == "ok", revision.message
    assert compare_goals(revision.goal, goal(then)).exact, str(revision.goal)


@pytest.mark.parametrize(
    ("last", "text", "then"),
    [
        (LINE, "and put the banana next to the plate", [*LINE, relation("next to", [5], [3])]),
        (LINE, "then stack the cans on the right", [*LINE, structure("tower", [6, 7], x_position="right")]),
        (LINE, "also put the bowl behind it", [*LINE, relation("behind", [4], {"part": 0})]),
        (LINE, "put the bowl to the left of the line as well", [*LINE, relation("left of", [4], {"part": 0})]),
        (LINE, "gaps of 5 cm", with_(LINE, 0, gap=0.05)),
        (LINE, "put them in a triangle", with_(LINE, 0, shape="triangle")),
        (LINE, "now a small arc", with_(LINE, 0, shape="arc", size="small")),
        (
            LINE,
            "spread them out evenly along the front edge",
            [structure("line", [0, 1, 2], size="large", along="near")],
        ),
        (TWO, "make a triangle out of the cups", [TWO[0], structure("triangle", [0, 1, 2], x_position="right")]),
        (TWO, "cups left, cans right", [TWO[0] | {"x_position": "right"}, TWO[1] | {"x_position": "left"}]),
        (CORNERS, "no wait: bowl on the right, plate on the left",
         [relation("at", [4], x_position="right"), relation("at", [3], x_position="left")]),
        (TWO, "and put the bowl in front of the tower", [*TWO, relation("in front of", [4], {"part": 0})]),
        (FRUIT, "then put the small can behind it", [*FRUIT, relation("behind", [7], [3])]),
    ],
)
def test_additions(say, last, text, then):
    revision = say(last, text)
    assert revision.status == "ok", revision.message
    assert compare_goals(revision.goal, goal(then)).exact, str(revision.goal)


@pytest.mark.parametrize(
    "text",
    ["bigger", "now a circle", "the other side", "add the bowl", "without the blue cup", "put the cups in a circle",
     "make it purple", "the same with the cans", "turn it by 90 degrees", "asdf qwer"],
)  # fmt: skip
def test_one_plain_structure_is_revised_as_before(say, parser, encoder, text):
    interpreter = Interpreter(lambda: parser, None, "robot", encoder)
    revision = say(LINE, text)
    assert revision.plain == interpreter.revise(StructureSpec("line"), text)
    assert (revision.status, revision.goal) == (revision.plain.status, goal(LINE))


@pytest.mark.parametrize(
    ("last", "text", "more"),
    [
        (TWO, "put the banana next to the plate", [relation("next to", [5], [3])]),
        (LINE, "put the plate, the bowl and the apple in a circle", [structure("circle", [3, 4, 8])]),
        (LINE, "stack the cans on the left, we'll need those later", [structure("tower", [6, 7], x_position="left")]),
        (CORNERS, "while you're at it, the apple goes behind the banana", [relation("behind", [8], [5])]),
    ],
)
def test_an_instruction_about_other_objects_adds_to_a_goal_that_is_still_to_be_built(say, last, text, more):
    revision = say(last, text)
    assert revision.kind == "add" and compare_goals(revision.goal, goal([*last, *more])).exact, str(revision.goal)
    assert "this adds to part 1 (" in revision.message


@pytest.mark.parametrize("state", [{"built": True}, {"declined": True}])
def test_an_instruction_about_other_objects_takes_the_place_of_a_goal_that_was_built_or_declined(say, state):
    revision = say(TWO, "put the banana next to the plate", **state)
    assert revision.kind == "new" and compare_goals(revision.goal, goal([relation("next to", [5], [3])])).exact
    assert ("this takes the place of part 1 (tower of" in revision.message) == ("declined" in state)


@pytest.mark.parametrize(
    ("last", "text", "then"),
    [
        (TWO, "scrap that, put the banana next to the plate", [relation("next to", [5], [3])]),
        (LINE, "No, start over: the banana next to the plate", [relation("next to", [5], [3])]),
        (TWO, "forget all of it. a line of the cups", [structure("line", [0, 1, 2])]),
        (FRUIT[:1], "no, the blue cup goes left of the banana", [relation("left of", [1], [5])]),
        (TWO, "put the cups and the cans in a line", [structure("line", [0, 1, 2, 6, 7])]),
    ],
)
def test_an_instruction_may_take_the_place_of_the_goal(say, last, text, then):
    revision = say(last, text)
    assert revision.status == "ok" and compare_goals(revision.goal, goal(then)).exact, str(revision.goal)


def test_an_instruction_takes_the_place_of_the_parts_about_its_objects_alone(say):
    parts = [*TWO, relation("behind", [4], {"part": 1})]
    revision = say(parts, "put the tall can next to the plate")
    assert compare_goals(revision.goal, goal([TWO[1], relation("behind", [4], {"part": 0}), relation("next to", [6], [3])])).exact
    assert "this takes the place of part 1 (tower of" in revision.message and revision.dropped == (0,)
    revision = say(parts, "put the cups in a line")
    assert compare_goals(revision.goal, goal([TWO[0], structure("line", [0, 1, 2], x_position="right"), parts[2]])).exact


def test_a_new_instruction_for_the_objects_of_a_part_takes_the_place_of_that_part_where_it_is(say):
    revision = say(TWO, "put the cups in a line")
    assert revision.kind == "edit" and revision.changed == (1,)
    assert compare_goals(revision.goal, goal([TWO[0], structure("line", [0, 1, 2], x_position="right")])).exact


def test_a_question_lists_the_parts_and_each_answer_leads_to_a_goal(say):
    revision = say(TWO, "the other side")
    assert (
        revision.question.slot == PART and revision.question.options[0] == "part 1 (tower of tall can, small can, left)"
    )
    left, right = with_(TWO, 0, x_position="right"), with_(TWO, 1, x_position="left")
    assert list(revision.choices) == [goal(left), goal(right), goal(with_(left, 1, x_position="left"))]


def test_an_instruction_about_some_of_the_objects_of_a_structure_is_a_question(say):
    revision = say(GAPS, "put the red cup in the bowl")
    rest = with_(GAPS, 0, objects=[1, 2])
    assert revision.status == "ask"
    assert list(revision.choices) == [goal([*rest, relation("in", [0], [4])]), goal([relation("in", [0], [4])])]


@pytest.mark.parametrize("text", ["put the red cup in the bowl, nothing else", "scrap that, put the red cup in the bowl"])
def test_an_instruction_that_says_what_becomes_of_the_others_is_no_question(say, text):
    revision = say(GAPS, text)
    assert (revision.status, revision.goal) == ("ok", goal([relation("in", [0], [4])]))


def test_what_is_said_once_more_changes_nothing(say):
    parts = [relation("left of", [5], [3]), structure("line", [0, 1, 2])]
    revision = say(parts, "put the banana to the left of the plate")
    assert (revision.status, revision.goal) == ("ok", goal(parts))


def test_an_object_that_is_not_clear_is_asked_for(say):
    revision = say(FRUIT, "also put the can next to the plate")
    assert revision.status == "ask" and revision.question.options == ("tall can", "small can")
    assert revision.choices == ("also put the tall can next to the plate", "also put the small can next to the plate")


def test_what_a_dropped_structure_was_needed_for_goes_too_and_is_said(say):
    parts = [*TWO, relation("behind", [4], {"part": 1})]
    revision = say(parts, "drop the circle")
    assert revision.goal == goal(TWO[:1]) and revision.dropped == (1, 2)
    assert "part 3 (bowl behind part 2) spoke of it, and is dropped too" in revision.message


def test_an_object_is_not_carried_to_two_places(say):
    revision = say(FRUIT, "also put the apple in the bowl")
    assert revision.status == "refused" and "apple has a place already, in part 2" in revision.message


def test_a_move_that_was_carried_out_goes_on_from_where_it_ended(say):
    assert say(MOVED, "5 cm more", built=True).goal == goal(with_(MOVED, 0, distance=0.05))
    back = say(MOVED, "make that 4 cm", built=True).goal
    assert back == goal(with_(MOVED, 0, direction="right", distance=0.06))


def test_from_across_the_table_left_is_the_speakers(say):
    spoken = say(TWO, "put the circle on the left", "opposite").goal
    assert spoken == goal(with_(TWO, 1, x_position="left"))
    added = say(TWO, "also put the banana left of the plate", "opposite").goal
    assert compare_goals(added, goal([*TWO, relation("left of", [5], [3])])).exact


@pytest.mark.parametrize(
    "text",
    ["-5 cm apart", "a gap of 1e9 cm", "drop part 99", "part 0 on the left", "swap everything", "", "?!.", "drop", "also",
     "and and and", "both both both on the left of part 7", "x" * 399, "put part 1 left of part 1", "add the unicorn to the circle",
     "make the circle of radius 1 km", "drop the circle " * 30],
)  # fmt: skip
@pytest.mark.parametrize("last", [TWO, ROW, FRUIT, GAPS, MOVED])
def test_hostile_sentences_get_one_sentence_and_change_nothing(say, last, text):
    revision = say(last, text)
    assert (
        revision.status in ("refused", "unchanged", "ask") and revision.goal == goal(last) and revision.message.strip()
    )


@pytest.mark.parametrize(
    "text", ["and bigger", "and a bit bigger", "then make the circle bigger", "also bigger please"]
)
def test_a_fragment_with_and_adds_nothing(say, text):
    revision = say(TWO, text)
    assert revision.status == "ok" and revision.goal == goal(with_(TWO, 1, size="large"))


def test_parts_alone_and_without_others():
    assert only_parts(goal(ROW), [1]) == goal([relation("left of", [4], [0, 1, 2])])
    assert without_parts(goal(ROW), [0]) == (Goal(), (0, 1))


def test_a_tag_question_places_nothing(say):
    found = say(LINE, "the red cup is out, right?")
    assert found.plain is None or found.plain.spec.x_position is None
