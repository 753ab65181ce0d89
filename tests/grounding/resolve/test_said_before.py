"""What was named before: "them", "the pair", "it", resolved from the words of labelled instructions."""

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.training.goal_corrections import goal_of
from grounding.training.goal_lines import GoalLine
from tests.grounding.labelled_words import resolved_label

ROWS = [
    (
        "garden", "I'd have the pots in a tight cluster at the back and the can to the right of them.",
        "cluster of the pots {0,1,2}, small, top; place of the can {4}, right of them {0,1,2}.",
    ),
    (
        "tall and short", "could the bottle and the jar stand side by side at the back, with the cup in front of them?",
        "line of the bottle {0} + the jar {3}, top; place of the cup {2}, in front of them {0,3}.",
    ),
    ("cans and cups", "All these cups! Stack them, for heaven's sake.", "tower of them {3,4,5,6}."),
    (
        "kitchen", "kettle left, pan right, teapot between the two",
        "place of kettle {0}, at left; place of pan {1}, at right; place of teapot {2}, between the two {0,1}.",
    ),
    ("toys", "Ducky goes on the left and the car goes behind him.",
     "place of Ducky {5}, at left; place of the car {2}, behind him {5}."),
    (
        "tea party", "Teapot, spoon behind it, green cup left of it.",
        "place of spoon {6}, behind it {0}; place of green cup {3}, left of it {0}.",
    ),
    ("lab", "tray yes. box? on it. vibes? immaculate.", "place of box {4}, on it {5}."),
    (
        "shapes", "A circle, 17 cm across is vague, so radius 9 cm: three cubes and two cylinders.",
        "circle of three cubes {0,1,2} + two cylinders {3,4}, radius 9 cm.",
    ),
    (
        "cans and cups", "Three cans, one stack. Next to the stack the red cup, and in front of it the other three as "
                         "a row.",
        "tower of Three cans {0,1,2}; place of the red cup {3}, next to structure 1; line of the other three {4,5,6}; "
        "place of structure 2, in front of it {3}.",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("scene", "text", "label"), ROWS, ids=[row[1] for row in ROWS])
def test_the_copied_words_mean_the_labelled_objects(scene, text, label):
    there = goal_scenes()[scene]
    found = resolved_label(GoalLine("", scene, text, label))
    assert found.goal is not None and not found.problem, found
    assert found.goal.resolved(len(there)).canonical() == goal_of(label, len(there)).resolved(len(there)).canonical()
