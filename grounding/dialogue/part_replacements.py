"""Put parts in the place of others: "put the apple in the bowl instead"."""

from __future__ import annotations

from grounding.dialogue.goal_changes import added, numbered, objects_of, with_part, without_parts
from grounding.dialogue.goal_revision import PART, GoalRevision, Turn, new_goal
from grounding.dialogue.scene_reader import SpokenReading
from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError, PartReference, RelationPart, StructurePart
from grounding.parse_result import Question


def replaced(turn: Turn, read: SpokenReading) -> GoalRevision | None:
    """Put parts in the place of those that move the same objects: "put the apple in the bowl instead".

    Returns:
        The goal; `None` where a part moves others.
    """
    goal, changed = turn.last, []
    for part in read.goal.parts:
        own = set(objects_of(read.goal, part.objects))
        same = [n for n, other in enumerate(turn.last.parts) if set(objects_of(turn.last, other.objects)) == own]
        if len(same) != 1 or any(isinstance(each, PartReference) for each in _ends(part)):
            return None
        goal = with_part(goal, same[0], part)
        changed.append(same[0])
    if len(goal.parts) == 1:
        return None
    return GoalRevision(goal, "ok", "edit", read.message, tuple(changed), read=read)


def which_is_replaced(turn: Turn, read: SpokenReading) -> GoalRevision:
    """Ask which part an instruction with "instead" replaces; there is nothing to ask where there is one part."""
    if len(turn.last.parts) == 1:
        return new_goal(turn.last, read, turn.text)
    options, choices = [], list[Goal | str]()
    for number in range(len(turn.last.parts)):
        fewer, gone = without_parts(turn.last, [number])
        try:
            choices.append(added(fewer, read.goal))
        except GoalError:
            continue
        options.append(numbered(turn.last, number, turn.said.names))
    options, choices = [*options, "all of it"], [*choices, read.goal]
    question = Question(PART, f"which part should it replace: {'; '.join(options)}?", tuple(options))
    return GoalRevision(turn.last, "ask", "edit", question.text, question=question, choices=tuple(choices))


def _ends(part: StructurePart | RelationPart) -> tuple[object, ...]:
    return (part.objects, part.reference) if isinstance(part, RelationPart) else (part.objects,)
