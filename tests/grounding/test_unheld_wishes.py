"""What a goal cannot hold is refused, asked about or remarked by all readers together: never left out in silence."""

from pathlib import Path

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from tests.grounding.goal_in_words import goal_of_words

UNSEEN = pytest.mark.xfail(reason="the verifier does not see it yet", strict=False)


@pytest.fixture(scope="module")
def objects():
    breakfast = [one for one in goal_scenes()["breakfast"] if one.name in ("bowl", "mug", "spoon", "plate")]
    return [*goal_scenes()["cans and cups"][:6], *breakfast]


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(
            "build a tower with the biggest can at the top",
            marks=pytest.mark.xfail(reason="the network takes it for the biggest at the bottom", strict=False),
        ),
        pytest.param(
            "put the cups in a circle, then in a line",
            marks=pytest.mark.xfail(reason="the network puts everything else in the line", strict=False),
        ),
        "put the fullest can on the left",
        "put the mug 5 to the left",
        "put the mug as far from the bowl as possible",
        pytest.param("don't touch the mug but put it in the middle", marks=UNSEEN),
        "put the cans in a triangle pointing at the mug",
        pytest.param("put the bowl back", marks=UNSEEN),
        "put everything back where it was",
        "make a row of cups that gets closer together toward the right",
        "set the table for two",
        "set the table for four people, facing me",
        "Set the table for two people sitting across from each other.",
        "Please make a table setting for a family of four.",
        "I want the mug directly opposite the bowl on the other side of the circle of cups.",
        "never put the cup near the bowl; place the cups in a line",
    ],
)
def test_a_wish_that_no_goal_can_hold_is_never_built_in_silence(interpreter, objects, text):
    read = interpreter.interpret(text, objects)
    assert read.status in ("refused", "ask") or read.message, str(read.goal)


def test_words_beside_a_structure_that_nobody_read_are_remarked(interpreter, objects):
    read = interpreter.interpret("put the cups in a circle but leave a gap big enough for my laptop", objects)
    assert read.status in ("refused", "ask") or read.message in read.notes, str(read.goal)


def test_the_third_of_what_was_placed_is_not_the_structure(interpreter, objects):
    read = interpreter.interpret("put two of the cans in a line and the third on top of the left one", objects)
    assert read.status in ("refused", "ask") or [str(part) for part in read.goal.parts][1].startswith("2 on")


@pytest.mark.parametrize(
    ("text", "goal"),
    [
        pytest.param(
            "set the table for my grandmother",
            "table setting of everything else",
            marks=pytest.mark.xfail(reason="asks who 'my grandmother' is", strict=False),
        ),
        ("make a table setting for one", "table setting of everything else"),
        ("put the cups in the back", "structure of 3, 4, 5, top"),
        pytest.param(
            "put the bowl at the back and the mug in front",
            "7 at top; 6 at bottom",
            marks=pytest.mark.xfail(reason="read as in front of the bowl", strict=False),
        ),
        (
            "stack the cans with the biggest can at the bottom",
            "tower of 0, 1, 2, order by volume descending from bottom",
        ),
        ("put the cups in a circle and the cans in a line", "circle of 3, 4, 5; line of 0, 1, 2"),
        ("don't put the mug on the plate, put it in the bowl", "6 in 7"),
        ("put cup 2 left of cup 3", "4 left of 5"),
        pytest.param(
            "put one can on the plate and the others in a row",
            "0 on 8; line of 1, 2",
            marks=pytest.mark.xfail(
                reason="asks whether 'the others' are the other cans or everything else", strict=False
            ),
        ),
        ("put the mug on the plate and the others in a row", "6 on 8; line of everything else"),
        ("move the mug 6in closer", "6 moved closer by 15.24 cm"),
        ("put the third can on the left", "2 at left"),
    ],
)
def test_wishes_that_only_look_like_these_are_still_read(interpreter, objects, text, goal):
    read = interpreter.interpret(text, objects)
    assert (read.status, read.message) == ("ok", "")
    assert compare_goals(read.goal, goal_of_words(goal), len(objects)).exact, str(read.goal)


@pytest.mark.parametrize(
    ("file", "count", "most_silent", "most_remarked"),
    [("unheld_wishes.txt", 79, 3, 4), ("unheld_wishes_h.txt", 50, 1, 2), ("unheld_wishes_j.tsv", 78, 1, 2)],
)
def test_of_many_wishes_that_no_goal_can_hold_few_are_built_in_silence(
    interpreter, objects, file, count, most_silent, most_remarked
):
    scenes = dict(goal_scenes())
    wishes = Path(__file__).with_name(file).read_text(encoding="utf-8").splitlines()[::2]
    cells = [line.rpartition("\t") for line in wishes]  # the scene's name comes first where there is one
    there = [(text, scenes.get(scene, objects)) for scene, _, text in cells]
    interpreter.read_ahead([(*each, Goal()) for each in there])
    read = [interpreter.interpret(*each) for each in there]
    silent = [text for text, each in zip(wishes, read, strict=True) if each.status == "ok" and not each.message]
    remarked = [text for text, each in zip(wishes, read, strict=True) if each.status == "ok" and each.message]
    print(file, len(wishes), len(silent), len(remarked))
    assert len(wishes) == count
    assert len(silent) <= most_silent, silent  # many of them say only how the arm should work ("simultaneously")
    assert len(remarked) <= most_remarked, remarked
