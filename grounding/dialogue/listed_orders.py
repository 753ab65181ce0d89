"""Order the objects of a structure as a sentence lists them: "the order should be pitcher, kettle, teapot"."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import replace

from grounding.dialogue.goal_changes import with_part
from grounding.dialogue.goal_revision import GoalRevision, Turn
from grounding.dialogue.object_exchanges import sentence_template
from grounding.goals.parts import SHAPES_OF_KEY, GoalError, Order, StructurePart

_POLITE = r"(?:(?:please|now|no|ok|okay|and|then|but|actually|sorry|wait|i want|i'd like|i meant?|make|have)[ ,]+)*"
_LIST = r"(?:the |my )?<\d>(?:[ ,]+(?:(?:and|then)[ ,]+)*(?:the |my )?<\d>)*"
_AFTER = r"(?:[ ,]+(?:please|instead|then|now))*[ .!]*"
_SENTENCES = tuple(
    re.compile(rf"{_POLITE}{pattern}{_AFTER}")
    for pattern in (
        rf"(?:the|its|their) order(?: (?:should|must|has to) be| is|:)?[ ,]+{_LIST}",
        rf"(?:in )?(?:this|that) order[ ,:]+{_LIST}",
        rf"(?:first )?{_LIST}[ ,]+in (?:that|this) order",
        rf"(?:order|sort|line up|arrange) (?:it|them) (?:as|like this|so)?[ ,:]*{_LIST}",
    )
)


def ordered_as_listed(turn: Turn) -> GoalRevision | None:
    """Return the goal in which the objects of its structure follow one another as they are listed.

    Returns:
        `None` where the sentence says something else, or does not list all objects of one structure once.
    """
    template, named = sentence_template(turn)
    if not named or turn.said.parts or not any(pattern.fullmatch(template) for pattern in _SENTENCES):
        return None
    said = tuple(index for one in named for index in one.indices)
    for number, part in enumerate(turn.last.parts):
        if not isinstance(part, StructurePart) or part.objects is None or part.shape not in SHAPES_OF_KEY["order"]:
            continue
        if sorted(said) != sorted(one for one in part.objects if isinstance(one, int)):
            continue
        start = part.order.start if part.order is not None and part.order.by == "listed" else None
        with suppress(GoalError):
            goal = with_part(turn.last, number, replace(part, objects=said, order=Order("listed", None, start)))
            return GoalRevision(goal, "ok", "edit", "", (number,))
    return None
