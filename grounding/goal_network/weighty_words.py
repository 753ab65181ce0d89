"""Know the words that change a wish although no part of a goal is copied from them."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from grounding.goals.goal import Goal

# Words that change a wish wherever they occur: no goal can hold them, so a goal without them is another wish.
WEIGHTY = frozenset(
    "upside inverted lean leans leaning tilt tilted tilting rotate rotated rotating flip flipped sideways lid "
    "lids handle handles spout spouts label labels half halves alternate alternately alternating alternates "
    "degrees degree diagonal diagonally under beneath underneath hang hanging float floating hover hovering "
    "otherwise flush heavier heaviest lighter lightest weight".split()
)
# Words that do so where the grammar does not know them.
WEIGHTY_IF_UNKNOWN = frozenset(
    "turn turned twist twisted lying upright open opened closed third quarter every twice again until unless "
    "parallel perpendicular angle angled without never balance balanced letter letters word words spell tomorrow "
    "later yesterday minutes seconds hours touch touches touching contact something somehow space room "
    "denser sparser trapezoid hexagon pentagon octagon rhombus dance dances dancing".split()
)
# Those of them that the labelled corrections have often, with goals that hold them.
_TAUGHT_IN_CORRECTIONS = frozenset("without open never".split())
_HALF_SHAPES = frozenset("circle circles moon ring round".split())  # after "half": an arc
_HALF_SIDES = frozenset("left right upper lower near nearer far farther front back rear top bottom".split())  # before it: a side
_EVERY_SOME = re.compile(r"\bevery (?:other|second|third|fourth|two|three|time|now|so)\b", re.IGNORECASE)


def weighty(words: Sequence[str]) -> bool:
    """Return whether words that no part of a goal was copied from change a wish wherever they occur."""
    for place, word in enumerate(words):
        if word == "half":
            before, after = words[:place][-1:], words[place + 1 : place + 2]
            if _HALF_SHAPES.isdisjoint(after) and _HALF_SIDES.isdisjoint(before):
                return True
        elif word in WEIGHTY:
            return True
    return False


def words_held(goal: Goal, text: str) -> set[str]:
    """Return the weighty words that a goal holds: the open side of an arc, all in "every block", half of a circle or a table."""
    words = {"half"}  # where it is no part of these it is in `weighty`
    if any(part.rotation is not None for part in goal.structures if part.shape in ("arc", "circle")):
        words |= {"open"}
    if not _EVERY_SOME.search(text):
        words |= {"every"}
    return words


def unknown_words(words: Sequence[str], taught: Collection[str]) -> tuple[str, ...]:
    """Return the words of a correction that the network was not taught, or that no goal can hold."""
    untaught = WEIGHTY_IF_UNKNOWN - _TAUGHT_IN_CORRECTIONS
    return tuple(word for word in words if word in untaught or (word[0].isalpha() and word not in taught))
