"""Put parts in the place of others: "put the apple in the bowl instead"."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import fields, replace

from grounding.dialogue.goal_changes import added, exchanged, numbered, objects_of, with_part, without_parts
from grounding.dialogue.goal_revision import PART, GoalRevision, Turn, new_goal
from grounding.dialogue.relation_edits import FILLERS
from grounding.dialogue.revision_words import AFRESH, NOTHING_ELSE, OF_THE_TABLE
from grounding.dialogue.scene_reader import SpokenReading
from grounding.goals.description import describe_parts
from grounding.goals.goal import Goal
from grounding.goals.parts import DIRECTIONAL, GoalError, Part, PartReference, RelationPart, StructurePart
from grounding.parse_result import OBJECT, Question

_EXCHANGING = FILLERS - frozenset("also so then on in by with from up out over".split())


def replaced(turn: Turn, read: SpokenReading) -> GoalRevision | None:
    """Put parts in the place of those that move the same objects: "put the apple in the bowl instead".

    Returns:
        The goal; `None` where a part moves others.
    """
    goal, changed = turn.last, []
    for part in read.goal.parts:
        own = set(objects_of(read.goal, part.objects))
        same = [
            n for n, other in enumerate(turn.last.parts)
            if set(objects_of(turn.last, other.objects)) == own
            and not (isinstance(part, StructurePart) and isinstance(other.objects, PartReference))
        ]  # fmt: skip
        if len(same) != 1 or any(isinstance(each, PartReference) for each in _ends(part)):
            return None
        old = turn.last.parts[same[0]]
        goal = with_part(goal, same[0], _beside(part, old, turn.said.said) or _at_its_place(part, old))
        changed.append(same[0])
    if len(goal.parts) == 1:
        return None
    return GoalRevision(goal, "ok", "edit", read.message, tuple(changed), read=read)


def _at_its_place(part: Part, old: Part) -> Part:
    """Return a structure that stands where the one before it should, unless it has a place of its own.

    Where no shape is said, it keeps its own, and all else that is not said: "cans on the right, cups on the left".
    """
    if not isinstance(part, StructurePart) or not isinstance(old, StructurePart):
        return part
    if part.shape is None and old.shape is not None:
        said = {each.name: value for each in fields(part) if (value := getattr(part, each.name)) is not None}
        return replace(old, **{key: value for key, value in said.items() if key != "objects"})
    if part.x_position or part.y_position:
        return part
    return replace(part, x_position=old.x_position, y_position=old.y_position)


def others_kept(turn: Turn, read: SpokenReading) -> GoalRevision | None:
    """Put an instruction in the place of the parts that move some of its objects; the other parts stay.

    Args:
        turn: the sentence and the goal.
        read: the sentence read as a whole instruction.

    Returns:
        `None` where the goal is not to be built any more, or where all of it or nothing of it is about these objects.
    """
    everything = any(part.objects is None for goal in (read.goal, turn.last) for part in goal.structures)
    if not turn.open or everything or AFRESH.search(turn.said.said):
        return None
    new = {one for part in read.goal.parts for one in objects_of(read.goal, part.objects)}
    same = [n for n, part in enumerate(turn.last.parts) if new & set(objects_of(turn.last, part.objects))]
    fewer, gone = without_parts(turn.last, same)
    if not same or not fewer.parts:
        return None
    try:
        goal = added(fewer, read.goal)
    except GoalError:
        return None
    replaced_parts = "; ".join(numbered(turn.last, number, turn.said.names) for number in gone)
    note = f"this takes the place of {replaced_parts}; “scrap that, …” takes the place of all"
    numbers = tuple(range(len(fewer.parts), len(goal.parts)))
    message = "; ".join(filter(None, (read.message, note)))
    return GoalRevision(goal, "ok", "new", message, numbers, tuple(gone), read=read)


def about_some(turn: Turn, goal: Goal) -> bool:
    """Return whether an instruction for the place of a structure leaves open what becomes of some of its objects."""
    if not turn.open or len(turn.last.parts) != 1 or any(each.search(turn.said.said) for each in (NOTHING_ELSE, AFRESH)):
        return False
    last = turn.last.parts[0]
    if not isinstance(last, StructurePart):
        return False
    new = {one for part in goal.parts for one in objects_of(goal, part.objects)}
    old = set(range(len(turn.said.objects)) if last.objects is None else turn.last.named_objects())
    everything = any(part.objects is None for part in goal.structures)
    exchange = any(isinstance(part, RelationPart) and part.relation == "swapped" for part in goal.parts)
    return new < old and not everything and not exchange


def which_objects_stay(turn: Turn, goal: Goal) -> GoalRevision | None:
    """Ask whether the other objects of a structure stay in it; `None` where the instruction leaves nothing open."""
    last = turn.last.parts[0] if turn.last.parts else None
    if not isinstance(last, StructurePart) or not about_some(turn, goal):
        return None
    placed = {one for part in goal.parts for one in objects_of(goal, part.objects)}
    own = range(len(turn.said.objects)) if last.objects is None else objects_of(turn.last, last.objects)
    try:
        both = added(Goal((replace(last, objects=tuple(one for one in own if one not in placed)),)), goal)
    except GoalError:
        return None
    options = tuple(describe_parts(each.parts, turn.said.names) for each in (both, goal))
    text = "do the other objects stay as they were asked for?"
    return GoalRevision(
        turn.last, "ask", "new", text, question=Question(PART, text, options), choices=(both, goal)
    )


def _beside(part: Part, old: Part, said: str) -> Part | None:
    """Return a relation to the same object on another side of it: "the bowl in front" of what it was left of."""
    if not isinstance(part, RelationPart) or not isinstance(old, RelationPart) or part.relation != "at":
        return None
    sides = [side for side in (part.x_position, part.y_position) if side is not None]
    if old.relation not in (*DIRECTIONAL, "next to") or len(sides) != 1 or OF_THE_TABLE.search(said):
        return None
    relation = {"left": "left of", "right": "right of", "bottom": "in front of", "top": "behind"}.get(sides[0])
    return None if relation is None else replace(old, relation=relation)


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


def which_object_goes(turn: Turn) -> GoalRevision | None:
    """Ask in place of which object another one is meant: "no, the banana"; `None` where that is not said."""
    named = [one for one in turn.said.mentions if len(one.indices) == 1]
    if len(named) != 1 or len(turn.said.mentions) != 1 or turn.said.left_over([named[0].span], _EXCHANGING):
        return None
    comes = named[0].indices[0]
    goes = [one for one in turn.last.named_objects() if isinstance(one, int)]
    if comes in goes:
        return None
    only = turn.last.parts[0] if len(turn.last.parts) == 1 else None
    if isinstance(only, RelationPart) and only.relation != "swapped" and len(_ends(only)[0]) == 1:  # type: ignore[arg-type]
        goes = goes[:1]  # of one relation what is placed is meant, and not what it is placed by
        with suppress(GoalError):
            goal = Goal((exchanged(only, {goes[0]: comes}),))
            note = f"{turn.said.names[comes]} in place of {turn.said.names[goes[0]]}"
            return GoalRevision(goal, "ok", "edit", note, (0,))
    options, choices = [], list[Goal | str]()
    for index in goes:
        with suppress(GoalError):
            choices.append(Goal(tuple(exchanged(part, {index: comes}) for part in turn.last.parts)))
            options.append(turn.said.names[index])
    if not options:
        return None
    text = f"in place of which object should {turn.said.names[comes]} be used: {'; '.join(options)}?"
    question = Question(OBJECT, text, tuple(options))
    return GoalRevision(turn.last, "ask", "edit", text, question=question, choices=tuple(choices))


def _ends(part: StructurePart | RelationPart) -> tuple[object, ...]:
    return (part.objects, part.reference) if isinstance(part, RelationPart) else (part.objects,)
