"""Check that a sentence has words for each change of a part: for a value, a place, a shape, objects that leave or join."""

from __future__ import annotations

import re

from grounding.dialogue.goal_changes import objects_of
from grounding.dialogue.goal_revision import Turn
from grounding.dialogue.revision_words import (
    AS_ANOTHER,
    BARE_SIDE,
    FEWER,
    FIRST_OR_LAST,
    HEAPS,
    INSTEAD,
    JOINING,
    LEAVING,
    NEGATED,
    OF_THE_TABLE,
    ON_TOP,
    PRONOUNS_OR_ALL,
    SAYS_NO_PLACE,
    SIDES,
    SIZE_WORDS,
    VALUE_WORDS,
    says_shape,
)
from grounding.goals.description import describe_part
from grounding.goals.goal import Goal
from grounding.goals.parts import DIRECTIONAL, Part, PartReference, RelationPart


def unsaid(turn: Turn, goal: Goal, before: Part, after: Part) -> str:
    """Return what changes of a part that nobody asked for; "" where the sentence has words for all of it.

    Args:
        turn: the sentence and the goal before.
        goal: the goal after it.
        before: the part before.
        after: the same part after it.
    """
    return (
        _unsaid_change(turn, before, after) or _denied_side(turn, before, after)
        or _side_of_what(turn, before, after) or _unsaid_loss(turn, goal, before, after)
    )  # fmt: skip


def _unsaid_change(turn: Turn, before: Part, after: Part) -> str:
    """A value changes only where the sentence has a word that can ask for it."""
    said = turn.said.said
    if turn.built and getattr(before, "relation", "") == "moved":
        return ""  # what it says is of where the object is now
    for name in ("size", *VALUE_WORDS):
        value = getattr(after, name, None)
        if value is None or value == getattr(before, name, None):
            continue
        pattern = SIZE_WORDS[value] if name == "size" else VALUE_WORDS[name]
        if not re.search(rf"\b(?:{pattern})\b", SAYS_NO_PLACE.sub(" ", said) if "position" in name else said):
            return f"no word of it asks for {name.replace('_', ' ')} {value}"
        if name == "y_position" and getattr(after, "shape", None) == "tower" and _of_a_tower(turn, value):
            return f"the {value} of a tower is no place on the table"
        if name == "size" and (FIRST_OR_LAST.search(_besides_parts(turn)) or _of_some(turn, before)):
            return f"no word of it asks for a structure of size {value}"
    return _unsaid_shape(turn, before, after)


def _of_a_tower(turn: Turn, end: str) -> bool:
    """Return whether a sentence may speak of an end of a tower: "on top", "the small one at the bottom"."""
    if ON_TOP.search(turn.said.said):
        return True
    said = _besides_parts(turn)
    return end == "bottom" and "bottom" in said and said == turn.said.said and not OF_THE_TABLE.search(said)


def _besides_parts(turn: Turn) -> str:
    """Return what is said besides the words for parts of the goal."""
    said = turn.said.said
    for first, end in sorted((one.span for one in turn.said.parts if one.numbers), reverse=True):
        said = f"{said[:first]} {said[end:]}"
    return said


def _of_some(turn: Turn, part: Part) -> bool:
    """Return whether a sentence speaks of single objects of a structure: "stretch the box"."""
    own = set(objects_of(turn.last, part.objects)) if part.objects is not None else set(range(len(turn.said.objects)))
    named = {index for one in turn.said.mentions for index in one.indices}
    return bool(named) and named < own and not turn.said.parts


def _unsaid_shape(turn: Turn, before: Part, after: Part) -> str:
    """A shape changes only where a word asks for it that is not what the structure was called."""
    old, shape, said = getattr(before, "shape", None), getattr(after, "shape", None), turn.said.said
    if shape is None or shape == old:
        return ""
    if not AS_ANOTHER.search(said):
        said = _besides_parts(turn)
    if old == "cluster":
        said = HEAPS.sub(" ", said)
    return "" if says_shape(shape, said) else f"no word of it asks for a {shape}"


def _denied_side(turn: Turn, before: Part, after: Part) -> str:
    """A side that is denied is not where the part stays: "not the back, over to the left"."""
    for side, shown in SIDES.items():
        denied = re.search(rf"\b(?:not|never) (?:(?:at|on|in|to|along|by|off|out|over|so far) )*(?:the |my )?(?:{side})\b", turn.said.said)
        if denied and re.search(rf"\b(?:{shown})\b", describe_part(after, None)):
            return f"{side.split('|')[0]!r} was denied"
    if getattr(after, "along", None) is not None and after.along == getattr(before, "along", None):  # type: ignore[union-attr]
        if any(getattr(before, slot) != getattr(after, slot) for slot in ("x_position", "y_position")):
            return "it is not clear whether the line goes along another edge"
    return ""


def _side_of_what(turn: Turn, before: Part, after: Part) -> str:
    """Where a relation places a structure, "the tower in front" can be of the table or of what it is placed by."""
    if before not in turn.last.parts or not BARE_SIDE.search(turn.said.said) or OF_THE_TABLE.search(turn.said.said):
        return ""
    number = turn.last.parts.index(before)
    placed = any(
        isinstance(part, RelationPart) and part.relation in DIRECTIONAL and part.objects == PartReference(number)
        for part in turn.last.parts
    )
    moved = any(getattr(before, slot, None) != getattr(after, slot, None) for slot in ("x_position", "y_position"))
    return "it is not clear which side of what is meant" if placed and moved else ""


def _unsaid_loss(turn: Turn, goal: Goal, before: Part, after: Part) -> str:
    """No object leaves a part without being named, and none is all that stays where it was to go."""
    there = range(len(turn.said.objects))
    old = set(there if before.objects is None else objects_of(turn.last, before.objects))
    new = set(there if after.objects is None else objects_of(goal, after.objects))
    lost = old - new
    said = turn.said.said
    named = _named(turn)
    if not new - old <= named and not PRONOUNS_OR_ALL.search(said):
        return "it names none of the objects that would join"
    if not lost:
        fewer = named & old and not old <= named and FEWER.search(said) and not new - old
        return "it names some of the objects, and all of them would stay" if fewer else ""
    if new <= named and not lost & named and NEGATED.search(said) and not LEAVING.search(said):
        return "what it names seems to leave, not to stay"
    if not lost & named and (JOINING.search(said) or not (LEAVING.search(said) or NEGATED.search(said))):
        return "it names none of the objects that would leave"
    elsewhere = {one for part in goal.parts for one in objects_of(goal, part.objects)}
    if lost - elsewhere and not any(each.search(said) for each in (LEAVING, NEGATED, FEWER, INSTEAD)):
        return "no word of it says that an object leaves"
    if lost & named and not lost <= named and not FEWER.search(said):
        return "it names only some of the objects that would leave"
    return ""


def _named(turn: Turn) -> set[int]:
    """Return the objects that a sentence names, also by their noun alone in a phrase that is not known."""
    nouns = set(turn.said.said.split())
    by_noun = {n for n in range(len(turn.said.names)) if {turn.said.kind(n), f"{turn.said.kind(n)}s"} & nouns}
    phrases = turn.said.mentions
    return {index for one in phrases for index in one.indices} | (
        by_noun if any(not one.indices for one in phrases) else set()
    )
