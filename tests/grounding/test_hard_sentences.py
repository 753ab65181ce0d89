"""Instructions of which a part was once lost in silence, each a kind with two variations: the goal, or a question or
refusal.

A row has the scene (a scene of the goal benchmark, or names), what is said, the goals that are right, and words of
which a question or a refusal has to speak instead; a goal that is built with a note on these words is right too.
"""

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goals.comparison import compare_goals
from tests.grounding.goal_in_words import goal_of_words
from tests.grounding.readers import reader

SETTING = ["plate", "fork", "knife", "spoon", "mug", "mug 2"]
BLOCKS = ["red block", "orange block", "yellow block", "green block", "blue block", "purple block"]
PAIRS = ["red block", "blue block", "toyota block", "nvidia block"]
BOWLS = ["green block", "blue block", "green bowl", "blue bowl"]
TWO_BOWLS = ["black bowl", "plate", "ramekin", "black bowl 2"]
TOWER = ["green block", "yellow block", "purple block"]
CANS = ["soup can", "tuna can", "corn can", "cereal box", "cracker box", "mug"]
ROWS = [
    # half a sentence dropped
    (SETTING, "Lay a place setting with the plate, fork, knife and spoon, and leave the mugs in a neat row at the far "
              "edge of the table",
     ["table setting of 0, 1, 2, 3; line of 4, 5, along far", "table setting of 0, 1, 2, 3; line of 4, 5, top"],
     "mugs"),
    (SETTING, "Line up the fork, the knife and the spoon on the left, and keep the mugs stacked near the right edge",
     ["line of 1, 2, 3, left; tower of 4, 5, right"], "mugs"),
    ("cans and cups", "Make a ring of the cups, and leave the cans in a tidy pile on the right hand side",
     ["circle of 3, 4, 5, 6; tower of 0, 1, 2, right", "circle of 3, 4, 5, 6; cluster of 0, 1, 2, right"], "cans"),
    # all of a kind of which there is one
    ("tall and short", "Everything that is a can should be beside the jar", ["1 next to 3"], "can"),
    ("breakfast", "Everything that is a bowl belongs next to the banana", ["2 next to 5"], "bowl"),
    ("desk", "All that is a mug should go behind the box", ["0 behind 4"], "mug"),
    # an order of everything
    ("grocery", "Order the groceries by size from near to far",
     ["line of everything, order by volume from near", "line of everything, order by volume ascending from near"],
     "size"),
    ("tall and short", "Sort everything by height from left to right",
     ["line of everything, order by height from left", "line of everything, order by height ascending from left"],
     "height"),
    ("garden", "Arrange the pots by size, smallest nearest to me, biggest at the far end",
     ["line of 0, 1, 2, order by volume ascending from near"],
     "pots"),
    # a correction inside the sentence
    (PAIRS, "ok so first off um take the red block and put it to the left of the blue block and then no wait I mean to "
            "the right",
     ["0 right of 1"], "red"),
    ("cans and cups", "put the cups in a line, no sorry, in a circle, on the left", ["circle of 3, 4, 5, 6, left"],
     "circle"),
    ("breakfast", "place the banana on the plate, uh, I mean in the bowl", ["5 in 2"], "bowl"),
    # two places, of which one is how near
    (PAIRS, "take the toyota block and place directly next to the nvidia block to the right", ["2 right of 3"],
     "right"),
    ("breakfast", "put the spoon right beside the plate on its left side", ["4 left of 3"], "left"),
    ("desk", "set the tape close to the box, just behind it", ["5 behind 4"], "behind"),
    # an object by where it stands
    (TWO_BOWLS, "pick up the black bowl between the plate and the ramekin and place it on the plate",
     ["0 on 1", "3 on 1"], "bowl"),
    ("breakfast", "take the spoon next to the bowl and lay it on the plate", ["4 on 3"], "spoon"),
    ("blocks", "take the block that is behind the yellow blocks and put it on the orange one", [], "behind"),
    # each to its own
    (BOWLS, "put the blocks in their corresponding bowls", ["0 in 2; 1 in 3"], "corresponding"),
    (BOWLS, "put each block into the bowl of its own colour", ["0 in 2; 1 in 3"], "block"),
    ("tea party", "put every cup on the saucer of the same colour", ["3 on 5"], "saucer"),
    # an order that is told as it is seen
    (TOWER, "Build a tower so that going up you see yellow, purple, green",
     ["tower of 1, 2, 0, order by listed from bottom"], "yellow"),
    (TOWER, "Stack them; from top to bottom it should read purple, green, yellow",
     ["tower of 2, 0, 1, order by listed from top", "tower of 1, 0, 2, order by listed from bottom"], "purple"),
    (TOWER, "make a row which from left to right goes green, purple, yellow",
     ["line of 0, 2, 1, order by listed from left"], "green"),
    # a list of colours
    (BLOCKS, "Line them up in rainbow order: red, orange, yellow, green, blue, purple",
     ["line of 0, 1, 2, 3, 4, 5, order by listed", "line of 0, 1, 2, 3, 4, 5, order by listed from left"], "rainbow"),
    (BLOCKS, "Put the blocks in a row in this order: blue, green, red, yellow",
     ["line of 4, 3, 0, 2, order by listed", "line of 4, 3, 0, 2, order by listed from left"], "order"),
    (BLOCKS, "Stack them like a traffic light: red at the top, yellow in the middle, green at the bottom",
     ["tower of 3, 2, 0, order by listed from bottom", "tower of 0, 2, 3, order by listed from top"], "traffic"),
    # all but one, and others too
    (CANS, "a line of cans but not the tuna, plus the boxes", ["line of 0, 2, 3, 4"], "tuna"),
    ("cans and cups", "a circle of the cups but not the yellow one, plus the green can", ["circle of 3, 5, 6, 2"],
     "yellow"),
    (CANS, "put the boxes and all the cans except for the soup in a row", ["line of 3, 4, 1, 2"], "soup"),
    # a number of them, but none of some
    ("blocks", "Make a line of four blocks, none of them red or blue",
     ["line of 4, 5, 6, 7", "line of 4, 5, 6, 8", "line of 4, 5, 7, 8", "line of 4, 6, 7, 8", "line of 5, 6, 7, 8"],
     "four"),
    ("cans and cups", "Make a ring of three cups, none of them yellow", ["circle of 3, 5, 6"], "yellow"),
    ("blocks", "stack two blocks, neither of them red, blue or green",
     ["tower of 6, 7", "tower of 6, 8", "tower of 7, 8"], "two"),
]  # fmt: skip


@pytest.fixture(scope="module")
def there():
    return reader()


@pytest.mark.parametrize(
    ("scene", "text", "goals", "words"), ROWS, ids=[getattr(row, "values", row)[1][:60] for row in ROWS]
)
def test_nothing_is_lost_in_silence(there, scene, text, goals, words):
    objects = goal_scenes()[scene] if isinstance(scene, str) else scene
    found = there.interpret(text, objects)
    if found.status == "ok":
        right = any(compare_goals(found.goal, goal_of_words(one), len(objects)).exact for one in goals)
        assert right or words in found.message, f"{found.goal}; {found.message}"
    else:
        assert words in found.message, found.message
