"""Define the keywords with which the goal network writes a goal.

A goal is written part by part: "tower of" START END "x left" "place of" START END "rel behind" START END. START and END
point at words of the instruction, so that objects and lengths are copied and never invented.
"""

from __future__ import annotations

from typing import NamedTuple

from grounding.goals.parts import EDGES, GROUPINGS, MOVE_DIRECTIONS, ORDER_KEYS, ORDER_STARTS, RELATIONS
from grounding.spec import ROTATIONS, SIZES, X_POSITIONS, Y_POSITIONS

KEYWORD, START, END = 0, 1, 2  # kinds of actions: a keyword, the first and the last word of a phrase

# Answers in place of a goal: nothing to arrange; what cannot be built; what can be read in several ways.
NOTHING = "nothing"
NO_GOAL = (NOTHING, "impossible", "unclear")
MOST_PARTS, MOST_PHRASES, MOST_WORDS, MOST_COUNT, MOST_STRUCTURES = 9, 9, 12, 20, 6
PLACED = tuple(one for one in RELATIONS if one not in ("at", "moved", "swapped"))
# The shapes that the shipped network was taught; the numbers of its keywords follow from them. Another shape is read as
# one of these (`grounding.propose.stand_ins`), so that it needs no training.
TAUGHT_SHAPES = (
    "circle", "line", "tower", "table setting", "cluster", "rectangle", "square", "triangle", "arc", "grid", "cross",
    "pyramid",
)  # fmt: skip
STRUCTURE_HEADS = tuple(f"{shape} of" for shape in (*TAUGHT_SHAPES, "structure"))
# "keep of" names what is said to stay, or to be left out.
HEADS = (*STRUCTURE_HEADS, "place of", "move of", "swap of", "keep of")
# The keys of a structure in the order in which they are written.
KEY_GROUPS: tuple[tuple[str, ...], ...] = (
    tuple(f"size {value}" for value in SIZES),
    tuple(f"x {value}" for value in X_POSITIONS),
    tuple(f"y {value}" for value in Y_POSITIONS),
    tuple(f"facing {value}" for value in ROTATIONS),
    tuple(f"order {by}" for by in ORDER_KEYS),
    ("gap",),
    ("radius",),
    ("length",),
    ("rows",),
    ("columns",),
    ("around",),
    tuple(f"along {edge}" for edge in EDGES),
    tuple(f"group {by}" for by in GROUPINGS),
)
KEYWORDS: tuple[str, ...] = (
    "<pad>", "<start>", "<end>", *HEADS, *NO_GOAL, "(all)",
    *(f"structure {number}" for number in range(1, MOST_STRUCTURES + 1)),
    *(keyword for group in KEY_GROUPS for keyword in group),
    "ascending", "descending", *(f"from {start}" for start in ORDER_STARTS), "distance",
    *(f"count {number}" for number in range(1, MOST_COUNT + 1)),
    *(f"rel {relation}" for relation in PLACED), "at", *(f"move {direction}" for direction in MOVE_DIRECTIONS),
)  # fmt: skip
NUMBER_OF = {keyword: number for number, keyword in enumerate(KEYWORDS)}
RANK_OF = {keyword: rank for rank, group in enumerate(KEY_GROUPS) for keyword in group}


class Action(NamedTuple):
    """One step of writing a goal.

    Attributes:
        kind: `KEYWORD`, `START` or `END`.
        value: the keyword's number, or the place of a word.
    """

    kind: int
    value: int


def keyword(name: str) -> Action:
    """Return the action that writes a keyword."""
    return Action(KEYWORD, NUMBER_OF[name])
