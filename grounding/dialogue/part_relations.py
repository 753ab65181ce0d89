"""Place a structure by another one of the goal: "put the blue tower to the left of the red tower"."""

from __future__ import annotations

import re
from contextlib import suppress

from grounding.dialogue.act_words import RELATIONS_SAID
from grounding.dialogue.goal_changes import with_part
from grounding.dialogue.goal_revision import GoalRevision, Turn
from grounding.goals.goal import Goal
from grounding.goals.parts import DIRECTIONAL, GoalError, PartReference, RelationPart, StructurePart

_PLACES = (*DIRECTIONAL, "next to")
_RELATION = "|".join(
    sorted((said for said, relation in RELATIONS_SAID.items() if relation in _PLACES), key=len, reverse=True)
)
_SENTENCE = re.compile(
    r"(?:(?:please|now|no|ok|okay|and|then|also|actually|sorry|i meant?|i want|i'd like|can you|could you|let|have)[ ,]+)*"
    r"(?:(?:put|move|place|bring|set|shift|build|get) )?<0>,?(?: (?:should|must|has to|needs to|to))?"
    r"(?: (?:be|go|goes|come|comes|stand|stands|is|belongs))?(?: (?:on|to))?(?: the)?"
    rf" (?P<relation>{_RELATION}) <1>(?:[ ,]+(?:please|instead|too|as well|then|not .*))*[ .!]*"
)


def parts_related(turn: Turn) -> GoalRevision | None:
    """Return the goal in which a structure stands beside another one of it; `None` where that is not said."""
    parts = turn.said.parts
    if len(parts) != 2 or any(len(one.numbers) != 1 for one in parts):
        return None
    (first, second) = (one.numbers[0] for one in parts)
    structures = [turn.last.parts[number] for number in (first, second)]
    if first == second or not all(isinstance(part, StructurePart) for part in structures):
        return None
    said = turn.said.said
    for number, one in reversed(list(enumerate(parts))):
        said = f"{said[: one.span[0]]}<{number}>{said[one.span[1] :]}"
    if (found := _SENTENCE.fullmatch(said)) is None:
        return None
    relation = RELATIONS_SAID[found["relation"]]
    part = RelationPart(relation, PartReference(first), PartReference(second))
    old = [
        number for number, other in enumerate(turn.last.parts)
        if isinstance(other, RelationPart) and other.objects == part.objects
    ]  # fmt: skip
    with suppress(GoalError):
        goal = with_part(turn.last, old[0], part) if old else Goal((*turn.last.parts, part))
        return GoalRevision(goal, "ok", "edit", "", (old[0] if old else len(turn.last.parts),))
    return None
