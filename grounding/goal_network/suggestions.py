"""Choose goals that an instruction may mean where it is refused: the goal network's likeliest ones.

What is refused because a word is not known, or a rule read it otherwise, is often read rightly by the network, but not
certainly enough to be built. A user who is shown that goal needs one word to have it.
"""

from __future__ import annotations

from collections.abc import Sequence

from grounding.goal_network.network_reading import NetworkReading, brings_together
from grounding.goal_network.weighty_words import weighty
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart

# Chosen on development instructions: half of those that are refused wrongly have the right goal among these, and few
# that are refused rightly have any.
LIKELY = 0.2
LIKELY_WITHOUT_A_REQUEST = 0.8  # the same, of a text that is worded like a question, or refused although all of it was understood
MOST_SUGGESTED = 2
_NO_WISH = 0.5  # how certain the network may be that nothing is asked for, or nothing that can be built


def suggested_goals(readings: Sequence[NetworkReading], requests: bool) -> tuple[Goal, ...]:
    """Return the goals to ask about, the likeliest first.

    Args:
        readings: the network's, of a text that is refused.
        requests: whether the text is worded as a request, of which some was not understood.
    """
    no_wish = sum(each.certainty for each in readings if each.answer)
    if no_wish > _NO_WISH:
        return ()
    least = LIKELY if requests else LIKELY_WITHOUT_A_REQUEST
    goals = [
        each.goal for each in readings
        if each.goal is not None and each.goal.parts and each.certainty >= least and not weighty(each.uncopied)
        and not brings_together(each) and all(map(_asks_for_something, each.goal.structures))
    ]  # fmt: skip
    return tuple(goals[:MOST_SUGGESTED])


def _asks_for_something(part: StructurePart) -> bool:
    """Return whether a structure is more than some objects: "only the boxes" asks for none."""
    return part.shape is not None or bool(part.keys) or any(part.spec.to_dict().values())
