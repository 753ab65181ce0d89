"""Which objects an instruction means: attributes, exceptions, groups, the other ones, and what pronouns stand for."""

from __future__ import annotations

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_reading.reader import GoalReader

READ = [
    # exceptions
    ("blocks", "all of them except the yellows and the orange one should be in a circle", "circle of 0, 1, 2, 3, 4, 5"),
    ("workshop", "form a circle with all the tools but the drill", "circle of 0, 2, 3, 4"),
    ("workshop", "the tools without the drill and the clamp in a triangle", "triangle of 0, 2, 3"),
    ("cans and cups", "line up the cups and the cans, except the red cup", "line of 4, 5, 6, 0, 1, 2"),
    ("cans and cups", "everything that is not a cup in a row", "line of 0, 1, 2"),
    ("blocks", "circle of all blocks that aren't red or blue", "circle of 4, 5, 6, 7, 8"),
    ("workshop", "put the non-blue screwdriver to the right of the box", "2 right of 5"),
    ("toys", "line up everything that's neither red nor blue", "line of 2, 5"),
    ("party", "a circle of the cups, no red ones please", "circle of 3, 4, 5"),
    ("blocks", "make a row of the blocks; the orange one is not part of it", "line of 0, 1, 2, 3, 4, 5, 6, 7"),
    ("toys", "don't touch the balls or the car; just make a small triangle out of the other three", "triangle of 3, 4, 5, small"),
    # attributes
    ("cans and cups", "whatever is green should be put next to whatever is white", "2 next to 5"),
    ("toys", "stack everything yellow on the right", "tower of 2, 5, right"),
    ("toys", "put all that is blue in a cluster", "cluster of 1, 4"),
    ("toys", "move the blue ball next to the block of the same color", "1 next to 4"),
    ("toys", "the round ones go left of the car and the duck behind it", "0, 1 left of 2; 5 behind 2"),
    ("tall and short", "the second tallest object should be put behind the shortest one", "4 behind 2"),
    ("tall and short", "put the thing that is taller than the box behind it", "0 behind 4"),
    ("blocks", "put the rightmost yellow block on top of the leftmost one", "6 on 7"),
    ("blocks", "put the leftmost red block on the rightmost one", "1 on 0"),
    ("party", "of the three red cups, take the middle one and put it into the bowl", "1 in 6"),
    ("party", "put the leftmost of the blue cups in the bowl", "4 in 6"),
    ("party", "take the red cup on the far left and place it behind the bowl", "2 behind 6"),
    ("desk", "put what you write with in the mug", "1, 2 in 0"),
    ("workshop", "put the power tool in the box", "1 in 5"),
    # others
    ("cans and cups", "put one can on the left and the other two on the right", "0 at left; structure of 1, 2, right"),
    ("cans and cups", "one of the cans goes on the left, another in the center and the remaining one on the right",
     "0 at left; 1 at center; 2 at right"),
    ("fruit and plate", "put one apple on the plate and the other behind it", "1 on 0; 2 behind 0"),
    ("fruit and plate", "put an apple on the plate and an apple left of it", "1 on 0; 2 left of 0"),
    # pronouns
    ("breakfast", "put the bowl on the plate, the banana behind it and the spoon in front of it",
     "2 on 3; 5 behind 3; 4 in front of 3"),
    ("breakfast", "put the spoon in the red mug and put that next to the plate", "4 in 0; 0 next to 3"),
    ("breakfast", "the red mug goes left of the bowl, the blue mug right of it and the spoon in it",
     "0 left of 2; 1 right of 2; 4 in 2"),
    ("breakfast", "put the spoon in the red mug, and then place the mug behind the bowl", "4 in 0; 0 behind 2"),
    ("dinner", "the fork left of the plate, the knife right of it, and the spoon right of that",
     "1 left of 0; 2 right of 0; 3 right of 2"),
    ("dinner", "take the cup and the bowl and put the former in the latter", "4 in 5"),
    ("cans and cups", "get the yellow cup. That one should sit between the red can and the green one.", "4 between 0, 2"),
    ("cans and cups", "line up the cans, put the yellow cup in front of them and the white one behind them",
     "line of 0, 1, 2; 4 in front of part 1; 5 behind part 1"),
    ("fruit and plate", "banana between the apples, and the red can behind the banana", "3 between 1, 2; 5 behind 3"),
    ("toys", "put the red ball next to the red block and the blue ball next to the blue one", "0 next to 3; 1 next to 4"),
    # what is left out
    ("blocks", "stack the red blocks, and the blue ones too", "tower of 0, 1; tower of 2, 3"),
    ("party", "reds get stacked back left. Blues, same thing, back right.", "tower of 0, 1, 2, left, top; tower of 3, 4, 5, right, top"),
    ("cans and cups", "stack the cans on the left and do the same with the cups on the right",
     "tower of 0, 1, 2, left; tower of 3, 4, 5, 6, right"),
    ("blocks", "build a tower of the red blocks and another one of the blue blocks", "tower of 0, 1; tower of 2, 3"),
]  # fmt: skip


@pytest.mark.parametrize(("scene", "text", "goal"), READ, ids=[text for _, text, _ in READ])
def test_the_objects_that_are_meant(scene, text, goal):
    reading = GoalReader().read(text, goal_scenes()[scene])
    assert reading.complete, (reading.problem, reading.residue, reading.question)
    assert str(reading.goal) == goal


@pytest.mark.parametrize(
    ("scene", "text", "words"),
    [
        ("dinner", "put the round things in a row", "it is not known which of the objects here are 'round'"),
        ("cans and cups", "put the taller of the two cans left of the white cup", "'the two cans' can be each of 3 objects"),
        ("toys", "put each ball next to the block with the same colour", "it is not clear which colour is meant"),
        ("cans and cups", "the red can next to the purple cup", "'purple cup'; of that kind there is only: cup (red)"),
        ("cans and cups", "put the red cup behind the can", "'the can' can be each of 3 objects"),
        ("blocks", "Of the two blue ones, take the one on the right and set it between the reds.", "red"),
    ],
)  # fmt: skip
def test_objects_that_are_not_clear_are_asked_for_or_told(scene, text, words):
    reading = GoalReader().read(text, goal_scenes()[scene])
    told = reading.problem or (reading.question.text if reading.question else "")
    assert not reading.goal.parts and words in told
