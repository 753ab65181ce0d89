"""Place an object on the other side of what another one was placed by: "and the egg on the opposite side"."""

from __future__ import annotations

import re
from contextlib import suppress

from grounding.dialogue.goal_changes import objects_of
from grounding.dialogue.goal_revision import GoalRevision, Turn
from grounding.dialogue.object_exchanges import sentence_template
from grounding.goals.goal import Goal
from grounding.goals.parts import OPPOSITE_DIRECTIONS, GoalError, RelationPart

_SENTENCE = re.compile(
    r"(?:(?:please|now|no|ok|okay|and|then|also|actually|sorry|i want|i'd like|can you|could you|let|have)[ ,]+)*"
    r"(?:(?:put|move|place|bring|set|add) )?(?:the |my )?<0>,?(?: (?:should|must|has to|needs to|to))?"
    r"(?: (?:be|go|goes|come|comes|stand|stands|is|belongs))? (?:on|at|to) (?:the|its) (?:other|opposite) side"
    r"(?: of (?:it|that|(?:the |my )?(?P<of><1>)))?(?:[ ,]+(?:please|too|as well|then))*[ .!]*"
)


def on_the_opposite_side(turn: Turn) -> GoalRevision | None:
    """Return the goal in which another object stands opposite to one that it places beside a third.

    Returns:
        `None` where the sentence says something else, or where no single relation can be meant.
    """
    template, named = sentence_template(turn)
    match = _SENTENCE.fullmatch(template)
    if match is None or len(named) != (2 if match["of"] else 1) or turn.said.parts:
        return None
    free = set(range(len(turn.said.objects))) - set(turn.last.named_objects())
    objects = named[0].of(free)
    if not objects or set(objects) != set(named[0].indices):
        return None
    beside = [part for part in turn.last.parts if isinstance(part, RelationPart) and part.relation in OPPOSITE_DIRECTIONS]
    if match["of"]:
        beside = [part for part in beside if named[1].of(set(objects_of(turn.last, part.reference)))]
    if len({(part.relation, part.reference) for part in beside}) != 1:
        return None
    part = RelationPart(OPPOSITE_DIRECTIONS[beside[0].relation], objects, beside[0].reference)
    with suppress(GoalError):
        goal = Goal((*turn.last.parts, part))
        return GoalRevision(goal, "ok", "add", "", (len(turn.last.parts),))
    return None
