"""Several clauses are composed: shared words, other shapes, members of a structure, orders and lengths in free words."""

import pytest

from grounding.goal_reading.reader import GoalReader
from grounding.goals.description import describe_part
from tests.grounding.goal_reading.test_reader import SCENES, interpreter  # noqa: F401


def parts_of(text, scene):
    reading = GoalReader().read(text, SCENES[scene])
    assert reading.complete, (reading.problem, reading.residue, reading.question)
    names = [each.name for each in SCENES[scene]]
    return [describe_part(part, names) for part in reading.goal.parts]


CANS, CUPS = "can, can 2, can 3", "cup, cup 2, cup 3, cup 4"


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("the cans and the cups in a tower and a circle respectively", [f"tower of {CANS}", f"circle of {CUPS}"]),
        ("one circle of cups and one of cans", [f"circle of {CUPS}", f"circle of {CANS}"]),
        ("stack the cans on the left, and do the same with the cups on the right",
         [f"tower of {CANS}, left", f"tower of {CUPS}, right"]),
        ("cans: line. cups: circle.", [f"line of {CANS}", f"circle of {CUPS}"]),
        ("line up the cans behind a circle of cups", [f"circle of {CUPS}", f"line of {CANS}", "part 2 behind part 1"]),
        ("cups in a circle. The cups should be 5 cm apart.", [f"circle of {CUPS}, gap 5 cm"]),
        ("Stack the cans: green goes at the bottom, then the red, blue up top.",
         ["tower of can 3, can, can 2, order by listed from bottom"]),
        ("cans in a row, shortest nearest me, tallest furthest away",
         [f"line of {CANS}, order by height ascending from near"]),
        ("white cup left, yellow cup right of the green can", ["cup 3 left of can 3", "cup 2 right of can 3"]),
        ("put the yellow cup and the white cup on either side of the red can",
         ["cup 2 left of can", "cup 3 right of can"]),
        ("line up the cans with exactly 3 cm clearance between neighbours", [f"line of {CANS}, gap 3 cm"]),
        ("a 40 cm line of cups", [f"line of {CUPS}, length 40 cm"]),
    ],
)  # fmt: skip
def test_clauses_are_composed(text, parts):
    assert parts_of(text, "cans and cups") == parts


@pytest.mark.parametrize(
    ("text", "scene", "status"),
    [
        ("stack the can and the box, jar to one side", "tall and short", "ask"),
        ("put the blocks in piles", "blocks", "refused"),
        ("put the duck 2 to 3 cm left of the car", "toys", "refused"),
        ("line up bottle, can and jar and box with the can in the middle", "tall and short", "refused"),
        ("put the red can on either side of the blue can", "cans and cups", "refused"),
    ],
)
def test_what_is_not_settled_is_not_built(interpreter, text, scene, status):  # noqa: F811
    found = interpreter.interpret(text, SCENES[scene])
    assert found.status == status and not found.goal.parts
