"""Add parts to a goal: "then put the apple on the plate", "also put the bowl behind it"."""

from __future__ import annotations

import re
from dataclasses import replace

from grounding.dialogue.goal_changes import added, listed, numbered, objects_of, references_of, with_part
from grounding.dialogue.goal_mentions import SHAPE_OF_NOUN, GoalText
from grounding.dialogue.goal_revision import PART, GoalRevision, Turn, new_goal
from grounding.dialogue.relation_edits import FILLERS
from grounding.dialogue.revision_words import AFRESH, INSTEAD
from grounding.dialogue.scene_reader import SpokenReading
from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError, RelationPart, StructurePart
from grounding.parse_result import Question
from grounding.spec import SLOTS, SpecError

_ADDING = re.compile(
    r"^(?:(?:ok|okay|good|great|nice|fine|now|so|well|please|thanks|yes|but|(?:would|could|can|will) you)[ ,]+)*"
    r"(?:and(?: then| also| after that| now)?|then(?: also)?|also|additionally|next|after (?:that|this)|afterwards?"
    r"|plus|besides"
    r"(?: that)?|furthermore|moreover|on top of that|in addition|as well as that|when (?:that|this) is done"
    r"|now also)[ ,]+"
)
_ADDED = re.compile(r"[ ,]+(?:too|as well|also|in addition|on top of that|afterwards|after that)$")
_ANOTHER_SHAPE = re.compile(
    r"\b(?:a second|another|one more|an additional|an extra|a further) (?:(?:small|medium|large|big|tight|wide|long|short) )?"
    rf"(?:{'|'.join(sorted(SHAPE_OF_NOUN, key=len, reverse=True))})\b"
)
ALL_THERE = re.compile(r"\b(?:everything|all|rest|others?|remaining|objects|things|items)\b", re.IGNORECASE)
_SAYING_NOTHING = FILLERS - frozenset("on in by with from up out over to at into".split())
_PRONOUN = re.compile(r"\b(?:it|them|they|that)\b")


def adds(turn: Turn) -> bool:
    """Tell whether a sentence has words that add: "also" or "and" at its beginning, "too" at its end, "a second line"."""
    return any(pattern.search(turn.said.said) for pattern in (_ADDING, _ADDED, _ANOTHER_SHAPE))


def addition(turn: Turn) -> GoalRevision | None:
    """Return the goal with the parts that a sentence such as "then put the apple on the plate" adds."""
    rest = _ADDED.sub("", _ADDING.sub("", turn.said.said)).strip(" ,")
    parts_said = GoalText(rest, turn.last, turn.said.objects, turn.said.encoder).parts
    if parts_said or _PRONOUN.search(rest):
        goal = _read_after(turn, rest)
        if goal is None:
            return None
        return GoalRevision(goal, "ok", "add", "", tuple(range(len(turn.last.parts), len(goal.parts))))
    read = turn.reader.read(rest)
    if (joined := _joined(turn, rest)) is not None:
        return joined
    if read.status != "ok" or not read.goal.parts:
        found = new_goal(turn.last, read, rest)
        return replace(found, kind="add", choices=tuple(f"also {text}" for text in found.choices))
    new = read.goal
    if any(part.objects is None for part in new.structures) and not ALL_THERE.search(rest):
        return None  # "and a bit to the left" is said of a part that is there
    slots = merged(turn, new)
    if slots is not None:
        return slots
    try:
        goal = added(turn.last, new)
    except GoalError as error:
        message = f"that cannot be added: {error}; say “instead” to replace a part"
        return GoalRevision(turn.last, "refused", "add", message, read=read)
    if (moved := _placed_as_well(turn, new)) is not None:
        return moved
    if twice := _placed_twice(turn, new):
        where = numbered(turn.last, twice[1], turn.said.names)
        message = f"{turn.said.names[twice[0]]} has a place already, in {where}; say “instead” to replace that"
        return GoalRevision(turn.last, "refused", "add", message, read=read)
    numbers = tuple(range(len(turn.last.parts), len(goal.parts)))
    return GoalRevision(goal, "ok", "add", read.message, numbers, read=read)


def said_besides(turn: Turn, read: SpokenReading) -> GoalRevision | None:
    """Return the goal with what an instruction of its own says of other objects than those that it places.

    Args:
        turn: the sentence and the goal.
        read: the sentence read as a whole instruction.

    Returns:
        `None` where the goal is not to be built any more, where the instruction is about objects of the goal, or where
        it is said to take the goal's place.
    """
    new = {one for part in read.goal.parts for one in objects_of(read.goal, part.objects)}
    old = {one for part in turn.last.parts for one in objects_of(turn.last, part.objects)}
    everything = any(part.objects is None for goal in (read.goal, turn.last) for part in goal.structures)
    if not turn.open or read.status != "ok" or everything or not new or not old or new & old:
        return None
    if INSTEAD.search(turn.said.said) or AFRESH.search(turn.said.said) or _turned_round(turn.last, read.goal):
        return None
    try:
        goal = added(turn.last, read.goal)
    except GoalError:
        return None
    note = f"this adds to {listed(turn.last, turn.said.names)}; “scrap that, …” takes its place"
    numbers = tuple(range(len(turn.last.parts), len(goal.parts)))
    return GoalRevision(goal, "ok", "add", "; ".join(filter(None, (read.message, note))), numbers, read=read)


def _turned_round(last: Goal, new: Goal) -> bool:
    """Return whether a relation places what another is placed by: "no, the bowl goes left of the cup"."""
    placed_by = [set(objects_of(last, references_of(part))) for part in last.parts]
    return any(
        set(objects_of(new, part.objects)) & by and set(objects_of(new, references_of(part))) & set(
            objects_of(last, other.objects)
        )
        for part in new.parts for other, by in zip(last.parts, placed_by, strict=True)
    )  # fmt: skip


def _joined(turn: Turn, rest: str) -> GoalRevision | None:
    """Return the goal in which a relation takes further objects, "the hammer too", or the question which one does.

    Returns:
        `None` where more than objects is said, or a structure may be meant.
    """
    said = GoalText(rest, turn.last, turn.said.objects, turn.said.encoder)
    named = tuple(dict.fromkeys(index for one in said.mentions for index in one.indices))
    if not named or not all(one.indices for one in said.mentions) or set(named) & set(turn.last.named_objects()):
        return None
    if said.left_over([one.span for one in said.mentions], _SAYING_NOTHING):
        return None
    options, choices = [], list[Goal | str]()
    for number, part in enumerate(turn.last.parts):
        if not isinstance(part, RelationPart) or not isinstance(part.objects, tuple) or part.relation == "swapped":
            return None
        options.append(numbered(turn.last, number, turn.said.names))
        choices.append(with_part(turn.last, number, replace(part, objects=(*part.objects, *named))))
    if len(choices) == 1:
        return GoalRevision(choices[0], "ok", "add", "", (0,))  # type: ignore[arg-type]
    names = " and ".join(turn.said.names[index] for index in named)
    question = Question(PART, f"which part should {names} join: {'; '.join(options)}?", tuple(options))
    return GoalRevision(turn.last, "ask", "add", question.text, question=question, choices=tuple(choices))


def merged(turn: Turn, new: Goal) -> GoalRevision | None:
    """Return the goal with slots for a structure that is there already: "and put the cups on the right"."""
    part = new.parts[0]
    if len(new.parts) != 1 or not isinstance(part, StructurePart) or part.shape is not None or part.objects is None:
        return None
    for number, other in enumerate(turn.last.parts):
        if isinstance(other, StructurePart) and set(objects_of(turn.last, other.objects)) == set(part.objects):
            values = {slot: value for slot in SLOTS if (value := getattr(part, slot)) is not None}
            try:
                return GoalRevision(with_part(turn.last, number, replace(other, **values)), "ok", changed=(number,))
            except SpecError as error:
                return GoalRevision(turn.last, "refused", message=str(error))
    return None


def _placed_as_well(turn: Turn, new: Goal) -> GoalRevision | None:
    """Return the goal in which an object goes where others do: "the can at the back as well" moves it from the front."""
    part = new.parts[0]
    if len(new.parts) != 1 or not isinstance(part, RelationPart) or part.relation != "at":
        return None
    for number, other in enumerate(turn.last.parts):
        same = set(objects_of(turn.last, other.objects)) == set(objects_of(new, part.objects))
        if isinstance(other, RelationPart) and other.relation == "at" and same:
            return GoalRevision(with_part(turn.last, number, part), "ok", "edit", "", (number,))
    return None


def _placed_twice(turn: Turn, new: Goal) -> tuple[int, int] | None:
    """Return an object that both goals carry somewhere, and the part that does so already."""
    carrying = ("on", "in", "at", "moved", "swapped")
    for part in new.parts:
        if not isinstance(part, RelationPart) or part.relation not in carrying:
            continue
        for number, other in enumerate(turn.last.parts):
            shared = set(objects_of(new, part.objects)) & set(objects_of(turn.last, other.objects))
            if shared and isinstance(other, RelationPart) and other.relation in carrying:
                return min(shared), number
    return None


def _read_after(turn: Turn, rest: str) -> Goal | None:
    """Read a sentence whose "it" or "the circle" is a part of the last goal.

    Returns:
        The last goal with the parts that the sentence adds; `None` where it cannot be read so.
    """
    for number in _antecedents(turn, rest):
        goal = turn.reader.continued(turn.last, rest, number)
        before = turn.last.parts
        if goal is not None and len(goal.parts) > len(before) and goal.parts[: len(before)] == before:
            return goal
    return None


def _antecedents(turn: Turn, rest: str) -> list[int]:
    """Return the parts that "it" may be, the likeliest first: the one that is named, otherwise the last one."""
    named = [n for one in GoalText(rest, turn.last, turn.said.objects).parts for n in one.numbers]
    return named or [len(turn.last.parts) - 1]
