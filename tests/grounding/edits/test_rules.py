"""What needs arithmetic: each rule with its examples, and sentences that no rule may touch."""

import pytest

from grounding.edits.parts import Standing
from grounding.edits.rules import edited
from grounding.goal_benchmark.rows import goal_scenes
from grounding.spec import StructureSpec
from tests.grounding.goal_in_words import goal_of_words

TABLE = goal_scenes()["cans and cups"]  # cans 0 to 2 (red, blue, green), cups 3 to 6 (red, yellow, white, blue)
LINE, RING, TOWER = "line of 0, 1, 2, gap 5 cm", "circle of 3, 4, 5, radius 15 cm", "tower of 0, 1, 2, left"
BESIDE, MOVED = "3 left of 0 by 10 cm", "3 moved left by 10 cm"
BOTH = f"{TOWER}; circle of 3, 4, 5, 6, right"

LENGTHS = [
    (LINE, "2 cm more", "line of 0, 1, 2, gap 7 cm"),
    (LINE, "another 2 cm between them, please", "line of 0, 1, 2, gap 7 cm"),
    (LINE, "add 1 cm to the gap", "line of 0, 1, 2, gap 6 cm"),
    (LINE, "gaps 2 cm tighter", "line of 0, 1, 2, gap 3 cm"),
    (LINE, "Increase the gap by 15 mm.", "line of 0, 1, 2, gap 6.5 cm"),
    (LINE, "reduce the spacing by 1 cm please", "line of 0, 1, 2, gap 4 cm"),
    (LINE, "increase the gap to 8 cm", "line of 0, 1, 2, gap 8 cm"),
    (BESIDE, "Reduce that to 8 cm.", "3 left of 0 by 8 cm"),
    (BESIDE, "widen it to 12 cm", "3 left of 0 by 12 cm"),
    (RING, "shrink the radius by 2 cm", "circle of 3, 4, 5, radius 13 cm"),
    (LINE, "drop the spacing by 5 mm", "line of 0, 1, 2, gap 4.5 cm"),
    (LINE, "gap up by 1 cm", "line of 0, 1, 2, gap 6 cm"),
    (LINE, "lower the gap to 2 cm", "line of 0, 1, 2, gap 2 cm"),
    (BESIDE, "reduce it by 3 cm", "3 left of 0 by 7 cm"),
    (LINE, "double the gap", "line of 0, 1, 2, gap 10 cm"),
    (LINE, "halve that", "line of 0, 1, 2, gap 2.5 cm"),
    (LINE, "three times as far apart", "line of 0, 1, 2, gap 15 cm"),
    (LINE, "one and a half times that spacing", "line of 0, 1, 2, gap 7.5 cm"),
    (LINE, "a bit further apart, like 10 cm", "line of 0, 1, 2, gap 10 cm"),
    (LINE, "closer, 3 cm", "line of 0, 1, 2, gap 3 cm"),
    ("3 left of 0", "make that 10 cm", "3 left of 0 by 10 cm"),
    (RING, "5 cm wider", "circle of 3, 4, 5, radius 20 cm"),
    (RING, "5 cm more radius", "circle of 3, 4, 5, radius 20 cm"),
    (RING, "make it 5 cm smaller", "circle of 3, 4, 5, radius 10 cm"),
    (BESIDE, "5 cm more", "3 left of 0 by 15 cm"),
    (BESIDE, "5 more", "3 left of 0 by 15 cm"),
    (BESIDE, "5 cm closer", "3 left of 0 by 5 cm"),
    (BESIDE, "5 cm further left", "3 left of 0 by 15 cm"),
    (BESIDE, "twice as far", "3 left of 0 by 20 cm"),
    (MOVED, "back by 3", "3 moved left by 7 cm"),
    (MOVED, "back by 12", "3 moved right by 2 cm"),
    (MOVED, "a bit further, like 15 cm", "3 moved left by 15 cm"),
    (f"{BESIDE}; 4 right of 0 by 10 cm", "both 2 cm more", "3 left of 0 by 12 cm; 4 right of 0 by 12 cm"),
    (f"{BESIDE}; 4 right of 0 by 10 cm", "the yellow cup 2 cm more", "3 left of 0 by 10 cm; 4 right of 0 by 12 cm"),
]
PLACES = [
    (TOWER, "a bit to the right", "tower of 0, 1, 2, center"),
    (TOWER, "further right", "tower of 0, 1, 2, center"),
    (BOTH, "the circle a bit further left", f"{TOWER}; circle of 3, 4, 5, 6, center"),
    (TOWER, "somewhat more to the back", "tower of 0, 1, 2, left, top"),
    (TOWER, "a bit closer to me", "tower of 0, 1, 2, left, bottom"),
    ("0 at top right", "a touch more to the left", "0 at top center"),
    ("line of 0, 1, 2, small", "bigger", "line of 0, 1, 2, medium"),
    ("line of 0, 1, 2, small", "make it a bit bigger", "line of 0, 1, 2, medium"),
    ("line of 0, 1, 2", "a bit wider", "line of 0, 1, 2, large"),
    ("line of 0, 1, 2, medium", "half as wide", "line of 0, 1, 2, small"),
]  # fmt: skip
SIDES = [
    (TOWER, "the other side", "tower of 0, 1, 2, right"),
    (TOWER, "put it on the other side of the table", None),
    (BESIDE, "no, other side", "3 right of 0 by 10 cm"),
    (BESIDE, "no, other side of the can", "3 right of 0 by 10 cm"),
    ("0 behind 3", "on the opposite side of it", "0 in front of 3"),
    (MOVED, "the other side", "3 moved right by 10 cm"),
    ("line of 0, 1, 2, along left", "the other side", "line of 0, 1, 2, along right"),
    ("0 on 3", "the other way round", "3 on 0"),
    ("line of 0, 1, 2, order by height ascending from left", "the other way round",
     "line of 0, 1, 2, order by height ascending from right"),
    ("tower of 2, 0, 1, order by listed", "reverse it", "tower of 1, 0, 2, order by listed"),
]  # fmt: skip
TURNS = [
    ("line of 0, 1, 2, facing north", "turn it by 90 degrees", "line of 0, 1, 2, facing east"),
    ("line of 0, 1, 2, facing north", "turn it clockwise", "line of 0, 1, 2, facing east"),
    ("triangle of 0, 1, 2, facing north", "a quarter turn to the left", "triangle of 0, 1, 2, facing west"),
    ("triangle of 0, 1, 2, facing north", "rotate it 180 degrees", "triangle of 0, 1, 2, facing south"),
    ("triangle of 0, 1, 2, facing north", "turn it around", "triangle of 0, 1, 2, facing south"),
    ("arc of 3, 4, 5, facing east", "spin it 90 degrees counterclockwise", "arc of 3, 4, 5, facing north"),
]  # fmt: skip
EXCHANGES = [
    (BOTH, "swap them", "tower of 0, 1, 2, right; circle of 3, 4, 5, 6, left"),
    (BOTH, "swap the tower and the circle", "tower of 0, 1, 2, right; circle of 3, 4, 5, 6, left"),
    ("0 on 3", "swap them", "3 on 0"),
    ("3 left of 0; 4 right of 0", "swap the red cup and the yellow cup", "4 left of 0; 3 right of 0"),
    ("3 left of 0; 4 right of 0", "swap the cups", "4 left of 0; 3 right of 0"),
    ("line of 0, 1, 2, order by listed from left", "swap the red can and the blue can",
     "line of 1, 0, 2, order by listed from left"),
    ("tower of 3, 4", "swap the cups", "tower of 4, 3, order by listed from bottom"),
]  # fmt: skip


@pytest.mark.parametrize(("goal", "said", "then"), [*LENGTHS, *PLACES, *SIDES, *TURNS, *EXCHANGES])
def test_a_rule_with_its_examples(goal, said, then):
    found = edited(goal_of_words(goal), said, TABLE)
    assert [str(one) for one in found.goals] == [then] if then else found is None, found


@pytest.mark.parametrize(
    ("goal", "said", "words"),
    [
        ("line of 0, 1, 2", "5 cm more", "give one, for example 'gap 10 cm'"),
        (LINE, "8 cm less", "would be -3 cm"),
        (TOWER, "further left", "already on that side"),
        (TOWER, "turn it by 90 degrees", "a tower has no rotation"),
        ("triangle of 0, 1, 2, facing north", "turn it by 45 degrees", "say 'turn it by 90 degrees'"),
        ("line of 0, 1, 2, facing north", "turn it around", "looks the same after half a turn"),
        (RING, "turn it clockwise", "a full ring looks the same"),
        (TOWER, "move it 5 cm to the left", "build it first, or say 'further to the left'"),
        ("0 on 3", "turn it clockwise", "only a structure can be turned"),
        ("tower of 0, 1, 2", "the other side", "say which side"),
        ("line of 0, 1, 2", "swap them", "name both"),
        ("line of 0, 1, 2", "swap the red can and the blue can", "you have not given an order"),
        ("line of 0, 1, 2, large", "bigger", "it is already large"),
    ],
)
def test_what_cannot_be_done_is_said_with_what_to_say_instead(goal, said, words):
    found = edited(goal_of_words(goal), said, TABLE)
    assert found.goals == () and words in found.message


@pytest.mark.parametrize(
    "said",
    ["make it purple", "add the white cup, 5 cm", "three more cups", "put the blue can on the left", "bigger and dance",
     "wobble it 5 cm", "drop it by 5 cm", "move it up 5 cm", "reduce it to 2",
     "what is 5 cm more?!x", "a circle instead", "only half of the cans", "forget it", ""],
)  # fmt: skip
def test_other_sentences_are_left_alone(said):
    found = edited(goal_of_words(LINE), said, TABLE)
    assert found is None or not found.goals


def test_several_parts_that_may_be_meant_are_whole_goals():
    found = edited(goal_of_words(f"{LINE}; {MOVED}"), "2 cm more", TABLE)
    assert [str(one) for one in found.goals] == [
        f"line of 0, 1, 2, gap 7 cm; {MOVED}", f"{LINE}; 3 moved left by 12 cm",
        "line of 0, 1, 2, gap 7 cm; 3 moved left by 12 cm",
    ]  # fmt: skip
    assert found.changed == ((0,), (1,), (0, 1))
    assert [str(one) for one in edited(goal_of_words(f"{LINE}; {MOVED}"), "2 cm more", TABLE, fresh=[1]).goals] == [
        f"{LINE}; 3 moved left by 12 cm"
    ]


def test_what_was_shown_fills_what_was_not_said():
    shown = [Standing(StructureSpec("line", "small", "right", "middle", "west"))]

    def after(said):
        return [str(one) for one in edited(goal_of_words("line of 0, 1, 2"), said, TABLE, shown).goals]

    assert after("bigger") == ["line of 0, 1, 2, medium"]
    assert after("further left") == ["line of 0, 1, 2, center"]
    assert after("the other side") == ["line of 0, 1, 2, left"]
    assert after("turn it by 90 degrees") == ["line of 0, 1, 2, facing north"]


def test_what_stands_is_moved_from_where_it_stands():
    stood = [Standing(stood=True)]
    found = edited(goal_of_words(TOWER), "move it 5 cm to the left", TABLE, stood)
    assert [str(one) for one in found.goals] == [f"{TOWER}; 0, 1, 2 moved left by 5 cm"] and found.changed == ((1,),)
    found = edited(goal_of_words(MOVED), "5 cm more", TABLE, stood)
    assert [str(one) for one in found.goals] == ["3 moved left by 5 cm"]  # it stands 10 cm away already
    found = edited(goal_of_words(MOVED), "back by 3", TABLE, stood)
    assert [str(one) for one in found.goals] == ["3 moved right by 3 cm"]
    found = edited(goal_of_words("line of 0, 1, 2"), "swap the red can and the blue can", TABLE, stood)
    assert [str(one) for one in found.goals] == ["line of 0, 1, 2; 0, 1 swapped"]
