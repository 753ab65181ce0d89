"""Labelled corrections are said about other goals, with the label that they have there."""

import numpy as np
import pytest

from grounding.goal_network.vocabulary import KEYWORD, KEYWORDS
from grounding.training.goal_corrections import GoalCorrection, corrected, goal_corrections
from grounding.training.goal_lines import GoalLine, goal_lines
from grounding.training.transferred_corrections import TransferredCorrections

LINE = GoalLine("", "cans and cups", "a row of the cups", "line of the cups {3,4,5,6}, small, top.")
TOWER = GoalLine("", "blocks", "stack the reds", "tower of the reds {0,1}, left.")


def of(correction, *lines):
    return TransferredCorrections([GoalCorrection(*correction)], lines, np.random.default_rng(0))


def test_change_of_a_slot_is_said_about_another_structure():
    said = of(("toys", "arc of the balls {0,1}.", "right side please", "arc of the balls {0,1}, right."), LINE, TOWER)
    rows = [said._changed() for _ in range(20)]
    after = {row.scene: row.after for row in rows}
    assert after == {
        "cans and cups": "line of the cups {3,4,5,6}, small, top, right.",
        "blocks": "tower of the reds {0,1}, right.",  # a place that is set is set whatever stood there
    }


def test_what_is_relative_is_said_where_the_same_stood():
    other = ("toys", "arc of the balls {0,1}, left.", "other side", "arc of the balls {0,1}, right.")
    assert of(other, LINE)._changed() is None
    assert of(other, TOWER)._changed().after == "tower of the reds {0,1}, right."


@pytest.mark.parametrize(
    "correction",
    [
        ("toys", "arc of the balls {0,1}.", "balls to the right", "arc of the balls {0,1}, right."),  # names objects
        ("toys", "arc of the balls {0,1}.", "only one", "arc of the balls {0}."),
        ("toys", "arc of the balls {0,1}.", "put them on the box", "place of the balls {0,1}, on the box {2}."),
    ],
)
def test_what_speaks_of_its_own_objects_stays_where_it_is(correction):
    assert not of(correction, LINE).changes


def test_a_shape_that_is_named_is_there():
    said = of(("toys", "arc of the balls {0,1}.", "the arc to the right", "arc of the balls {0,1}, right."), LINE)
    assert said._changed() is None


def test_another_part_stays_beside_it():
    correction = ("blocks", "tower of the reds {0,1}, left.", "tower to the right", "tower of the reds {0,1}, right.")
    line = GoalLine("", "blocks", "a row of the blue ones", "line of the blue ones {2,3}.")
    row = of(correction, line)._beside()
    assert row.after == "tower of the reds {0,1}, right; line of the blue ones {2,3}."
    assert corrected(row).label.startswith("tower of the red blocks, right; line of the blue blocks")
    assert of(correction, TOWER)._beside() is None  # two towers of the same blocks


def test_draws_are_tasks_that_repeat():
    lines = goal_lines()[:400]
    draws = [
        [TransferredCorrections(goal_corrections(), lines, np.random.default_rng(7)).draw() for _ in range(3)]
        for _ in range(2)
    ]
    assert draws[0] == draws[1]
    for task in draws[0]:
        assert (task.steps[-1][0], KEYWORDS[task.steps[-1][1][0]]) == (KEYWORD, "<end>")
        assert task.said_from > 0
