"""Refusals say which words, why, and a sentence that would work."""

import pytest

from grounding.decide import Candidate, Decision
from grounding.goals.goal import Goal
from grounding.propose.proposal import Proposal
from grounding.sentences import doubts, reason, shape_question
from tests.grounding.goal_in_words import goal_of_words
from tests.grounding.readers import reader

TABLE = ("red cup", "blue cup", "plate", "bottle", "fork")
CUPS = ("cup", "cup", "can", "can", "can", "can", "bowl")
LINE = goal_of_words("line of 2, 3, 4, 5")


def refused(*proposals, goal=None, lost=(), names=CUPS):
    chosen = None if goal is None else Candidate(Proposal(goal, 0.3), lost=lost)
    return reason("do it", Decision("refused", chosen, () if goal is None or lost else (goal,)), proposals, names)


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (
            refused(Proposal(None, 0.9, problem="nothing here is 'the fork'")),
            "'do it' cannot be built: nothing here is 'the fork'",
        ),
        (
            refused(Proposal(None, 0.9, "nothing")),
            ", pyramid, a figure such as a heart or a letter T, or a place); say what should go where, for example "
            "'put cup "
            "next to the bowl'",
        ),
        (
            refused(Proposal(None, 0.9, "unclear"), goal=LINE),
            "'do it' does not say clearly which objects or which place it means; name them, or say 'a line of the "
            "four cans'",
        ),
        (
            refused(Proposal(LINE, 0.3), goal=LINE, lost=("upside down",)),
            "'upside down' in 'do it' cannot be built; leave it out: say 'a line of the four cans'",
        ),
        (
            refused(Proposal(LINE, 0.3), goal=LINE),
            "it is not clear what 'do it' means; say 'a line of the four cans'",
        ),
        (
            refused(names=None),
            "it is not clear what 'do it' means; say what should go where, for example 'stack the cans on the left'",
        ),
        (
            refused(names=("cup",)),
            "it is not clear what 'do it' means; say where it should stand, for example 'put the cup on the left'",
        ),
        (refused(names=()), "it is not clear what 'do it' means; there is nothing here"),
        (
            refused(Proposal(None, 0.9, "impossible"), goal=LINE),
            "'do it' does not ask for an arrangement of objects that can be built (circle, line, tower,",
        ),
    ],
)
def test_reasons(found, said):
    assert said in found


def test_the_problem_of_an_unlikely_reading_is_no_reason():
    wrong = Proposal(None, 0.1, problem="nothing here is called 'can'")
    assert "called" not in refused(Proposal(LINE, 0.3), wrong, goal=LINE)
    assert "called" not in refused(Proposal(None, 0.8, "impossible"), wrong)
    absent = Proposal(None, 0.02, problem="nothing here is 'the fork'", absent=True)
    assert "'the fork'" in refused(Proposal(None, 0.9, "impossible"), absent)
    assert "'the fork'" not in refused(Proposal(None, 0.9, "nothing"), absent)
    assert "called" in refused(wrong) and "called" in refused(Proposal(None, 0.8, "unclear"), wrong)


def test_only_shapes_that_can_be_had_are_asked_about():
    question, goals = shape_question(goal_of_words("structure of 0, 1"), CUPS)
    assert question.options == ("line", "tower", "table setting", "cluster")
    assert [goal.structures[0].shape for goal in goals] == list(question.options)
    assert shape_question(LINE, CUPS) is None and shape_question(Goal(), CUPS) is None


def test_words_that_may_be_lost_are_told():
    assert doubts(()) == () and doubts(("upside down", "two thirds")) == (
        "this may ignore 'upside down' and 'two thirds'; say it another way if it matters",
    )


@pytest.mark.parametrize(
    ("text", "names", "said"),
    [
        (
            "put the cups in a ring",
            CUPS,
            "a circle needs 3 objects, but the two cups are only 2; say 'a line of the two cups'",
        ),
        (
            "arrange the cans in a cross",
            CUPS,
            "a cross needs 5 objects, but the four cans are only 4; say 'a line of the four cans'",
        ),
        ("stack the banana on the bowl", CUPS, "banana"),
        ("put the cans in a grid of 3 rows and 3 columns", CUPS, "say 'a grid of the four cans with "),
        (
            "make a circle of the balls",
            ("ball", "ball", "cup"),
            "a circle needs 3 objects, but the two balls are only 2",
        ),
        ("put the mug on the left", ("plate", "cup", "bowl"), "there is no mug here; does 'the mug' mean: cup?"),
        ("put the banana on the left", ("plate", "cup"), "nothing here is 'the banana'; there is only: plate, cup"),
        (
            "put the pineapples in a line",
            ("can", "can 2", "cup"),
            "nothing here is 'the pineapples'; there is only: can, can 2, cup",
        ),
        ("circle of forks", ("can", "can 2", "cup"), "nothing here is 'forks'"),
        ("put the mugs in a line", ("can", "cup", "cup 2"), "there is no mug here; does 'the mugs' mean: cup; cup 2?"),
        *(
            (text, TABLE, "there is no mug here; does 'the mug")
            for text in (
                "put the mug on the plate",
                "put the mugs on the plate",
                "place the mug in front of the bottle",
            )
        ),
        ("put the pen behind the box", ("pencil", "box"), "there is no pen here; does 'the pen' mean: pencil?"),
        ("put the jug next to the box", ("bottle", "box"), "there is no jug here; does 'the jug' mean: bottle?"),
        (
            "put the red purse next to the box",
            ("red wallet", "blue wallet", "box"),
            "there is no purse here; does 'the red purse' mean: red wallet?",
        ),
        (
            "put cup 3 next to bowl 2",
            ("cup 1", "bowl 2", "object 3, red"),
            "there is no cup 3 here; does 'cup 3' mean: object 3, red?",
        ),
        ("put cup 2 next to cup 1", ("cup 1", "bowl 2", "object 3"), "nothing here is 'cup 2'"),
        ("put cups 1 and 7 in a line", ("cup 1", "cup 2", "object 3"), "nothing here is 'cup 7'"),
        ("put the hammer on the plate", TABLE, "nothing here is 'the hammer'"),
        ("put a cup left of the plate", TABLE, "is this meant: red cup left of plate?"),
        ("stack two cups", ("can", "cup", "cup 2", "cup 3"), "is this meant: tower of cup, cup 2?"),
        ("wash two cups", ("can", "cup", "cup 2", "cup 3"), "'wash two cups' does not ask for an arrangement"),
        ("hang the mug on the wall", TABLE, "does not ask for an arrangement"),
        ("stack the balls", ("ball", "ball", "cup"), "nothing can stand on a ball"),
        ("put the cup on the ball", ("ball", "ball 2", "cup"), "ball"),
    ],
)
def test_a_refusal_from_end_to_end(text, names, said):
    reading = reader().interpret(text, names)
    assert reading.status in ("refused", "ask") and said in reading.message, (reading.status, reading.message)


@pytest.mark.parametrize(
    ("text", "goal"),
    [
        ("put a fork next to the plate", "4 next to 2"),
        ("place a fork beside a plate", "4 next to 2"),
        ("put any bottle behind a plate", "3 behind 2"),
        ("set some fork to the right of the bottle", "4 right of 3"),
        ("put the red cup on a plate", "0 on 2"),
    ],
)
def test_what_there_is_one_of_needs_no_choice(text, goal):
    reading = reader().interpret(text, TABLE)
    assert (reading.status, reading.goal) == ("ok", goal_of_words(goal)), reading.message
