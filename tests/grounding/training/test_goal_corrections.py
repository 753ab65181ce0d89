"""Labelled corrections become tasks of the goal network, in the words of the goal so far and of what is said."""

import numpy as np
import pytest

from grounding.goal_network.vocabulary import KEYWORD, KEYWORDS
from grounding.goals.goal import Goal
from grounding.training.goal_corrections import (
    DrawnCorrections,
    GoalCorrection,
    corrected,
    goal_corrections,
    goal_of,
    goals_of,
    rewritten,
)
from grounding.training.goal_lines import GoalLine, LabelError, goal_lines

SCENE, BEFORE = "cans and cups", "tower of the tins {0,1,2}, left; circle of the cups {3,4,5,6}, right."


def label_of(text, after, before=BEFORE):
    return rewritten(GoalCorrection(SCENE, before, text, after))[1]


def test_goal_of_label():
    assert str(goal_of(BEFORE)) == "tower of 0, 1, 2, left; circle of 3, 4, 5, 6, right"
    across = "circle of the cups {3,4,5,6}, radius 40 cm {0.2}; keep of the can {0}."
    assert str(goal_of(across)).endswith("radius 20 cm")


def test_label_copies_the_goal_and_what_is_said():
    after = "circle of the cups {3,4,5,6}, left; place of the red tin {0}, behind structure 1."
    assert label_of("no, the ring to the left, and the red tin behind it", after) == (
        "circle of the cups, left; place of the red tin, behind structure 1"
    )
    # What stands in the goal alone is said as the goal is rendered: "cans" for the tins of the label.
    assert label_of("drop the circle", "tower of the tins {0,1,2}, left.") == "tower of the cans, left"


def test_new_length_is_copied_and_an_old_one_rendered():
    before = "line of the cups {3,4,5,6}, gap two inches."
    assert label_of("at the back", "line of the cups {3,4,5,6}, top, gap two inches.", before).endswith("gap 5.08 cm")
    assert label_of("8 cm apart", "line of the cups {3,4,5,6}, gap 8 cm.", before).endswith("gap 8 cm")


def test_object_left_out_is_kept():
    after = "tower of the tins {0,1,2}, left; circle of the cups {4,5,6}, right; keep of the red cup {3}."
    label = "tower of the cans, left; circle of the cups, right; keep of the red cup"
    assert label_of("not the red cup", after) == label


def test_what_stays_left_out_is_not_everything_again():
    before = "circle of (all); keep of the cans {0,1,2}."
    assert (
        label_of("smaller", "circle of (all), small; keep of the cans {0,1,2}.", before) == "circle of the cups, small"
    )
    after = "circle of (all); keep of the cans {0,1,2}; keep of the white cup {5}."
    assert label_of("the white cup stays, too", after, before) == "circle of the cups; keep of the white cup"
    assert label_of("everything after all", "circle of (all).", before) == "circle of (all)"


def test_another_order_is_written_in_that_order():
    before = "line of the red can {0} + the blue can {1} + the green can {2}, order listed from left."
    after = "line of the green can {2} + the blue can {1} + the red can {0}, order listed from left."
    assert (
        label_of("the other way round", after, before)
        == "line of the green can + the blue can + the red can, order listed from left"
    )
    after = (
        "line of the white cup {5} + the red can {0} + the blue can {1} + the green can {2}, order listed from left."
    )
    label = "line of the white cup + the red can + the blue can + the green can, order listed from left"
    assert label_of("and the white cup at the head", after, before) == label


def test_one_of_several_alike_has_a_phrase_of_its_own():
    rendition, label = rewritten(GoalCorrection(
        "tea party", "place of the green cup {3}, on the green saucer {5}; place of a white cup {1}, on the white "
                     "saucer {4}.",
        "no green cup", "place of a white cup {1}, on the white saucer {4}.",
    ))  # fmt: skip
    assert label == "place of cup 1, on the white saucer"
    assert f" {rendition.text} ".count(" cup 1 ") == 1


def test_what_a_pronoun_stands_for_is_said_by_the_goal_so_far():
    before = "place of the red cup {3}, on the red can {0}."
    assert (
        label_of("no, behind it", "place of the red cup {3}, behind it {0}.", before)
        == "place of the red cup, behind the red can"
    )
    after = "place of the red cup {3}, on the red can {0}; place of it {6}, behind the red can {0}."
    assert label_of("the blue cup, it goes behind the can", after, before).endswith("place of it, behind the red can")


def test_objects_that_cannot_be_pointed_at():
    with pytest.raises(LabelError, match="no phrase of the goal"):
        label_of("one less", "tower of the tins {0,1}, left.")


def test_answer_and_computed():
    assert label_of("5 cm more", "computed.") == "unclear"
    assert label_of("thanks", "nothing.") == "nothing"


def test_all_rows_but_few_are_tasks():
    rows, errors = goal_corrections()[::8], []
    for row in rows:
        try:
            assert KEYWORDS[corrected(row).steps[-1][1][0]] == "<end>"
        except LabelError as error:
            errors.append(str(error))
    assert len(rows) > 4000 and len(errors) <= 0.01 * len(rows), errors


def test_goals_of_labelled_texts():
    before, goal = goals_of(GoalCorrection(SCENE, BEFORE, "drop the circle", "tower of the tins {0,1,2}, left."))
    assert len(before.parts) == 2 and str(goal) == "tower of 0, 1, 2, left"
    assert goals_of(GoalCorrection(SCENE, BEFORE, "5 cm more", "computed."))[1] is None
    assert goals_of(GoalLine("x", SCENE, "well", "nothing.")) == (Goal(), None)


def test_drawn_corrections_replace_or_add():
    draws = DrawnCorrections(goal_lines()[:400], np.random.default_rng(3))
    tasks = [draws.draw() for _ in range(60)]
    assert all(task.words[:3] == ("so", "far", ":") and task.words[task.said_from - 1] == ":" for task in tasks)
    copied = [any(kind != KEYWORD and at[0] < task.said_from for kind, at in task.steps) for task in tasks]
    assert 5 < sum(copied) < 50  # the others take the goal's place
    begins = [" ".join(task.words[task.said_from :][:2]) for task, kept in zip(tasks, copied, strict=True) if not kept]
    assert any(begin in ("scrap that", "forget that", "new idea", "start over", "no ,") for begin in begins)


def test_what_is_kept_is_no_part_of_all():
    label = "circle of (all), large; keep of the plate {3}."
    assert goal_of(label).parts[0].objects is None
    assert goal_of(label, 6).parts[0].objects == (0, 1, 2, 4, 5)
    named = "line of (all); place of the mug {0}, behind the bowl {2}; keep of the plate {3}."
    assert goal_of(named, 6).parts[0].objects == (1, 4, 5)
