"""Check the effect of a correction against its words, so that no rule changes what nobody spoke of.

The rules of corrections each know a few words, and what is said around these can mean something else: "the green can
doesn't belong" is no wish for a tower of the green can. A goal is only changed in what the sentence has words for.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from grounding.dialogue.goal_changes import objects_of
from grounding.dialogue.goal_mentions import colors_of
from grounding.dialogue.goal_revision import Turn
from grounding.dialogue.part_checks import unsaid
from grounding.dialogue.part_replacements import about_some
from grounding.dialogue.revision_words import (
    AFRESH,
    DENYING,
    EVERYTHING,
    KEPT,
    NO_SIDE,
    ONE_OF_A_ROW,
    RELATED_BY,
    SIDES,
    SUPERLATIVE,
    THAT_PLACE,
)
from grounding.goal_reading.verb_words import VERBS
from grounding.goals.description import describe_part
from grounding.goals.goal import Goal
from grounding.goals.parts import DIRECTIONAL, Part, RelationPart, StructurePart

_SOME_ONLY = "it does not say what becomes of the other objects"


def unsupported(turn: Turn, goal: Goal, kind: str) -> str:
    """Return why a correction does not say what the rules made of it; "" where it does.

    Args:
        turn: the sentence and the goal before.
        goal: the goal after it.
        kind: of the revision: "edit", "add" or "new".
    """
    if not turn.last.parts or not goal.parts:
        return "" if goal.parts or not turn.last.parts else "nothing of the goal would be left"
    if reason := _everything_unsaid(turn, goal):
        return reason
    if reason := _contradicted(turn, goal):
        return reason
    if reason := _unused_side(turn, goal) or _unclear_loss(turn, goal) or _denied_object(turn, goal):
        return reason
    if kind in ("new", "add") and (reason := _of_the_goal(turn, goal)):
        return reason
    if kind == "new":
        return _half_new(turn, goal) or (_SOME_ONLY if about_some(turn, goal) else "")
    for before, after in _changed(turn.last, goal):
        if reason := unsaid(turn, goal, before, after):
            return reason
    return _unclear_one(turn, goal) or _unused_object(turn, goal)


def _changed(last: Goal, goal: Goal) -> Iterator[tuple[Part, Part]]:
    """Yield the parts that a correction changed, before and after it."""
    if len(last.parts) == len(goal.parts):
        for before, after in zip(last.parts, goal.parts, strict=True):
            kept = before in goal.parts or after in last.parts  # at another place
            if before != after and type(before) is type(after) and not kept:
                yield before, after


def _everything_unsaid(turn: Turn, goal: Goal) -> str:
    """A fragment that names no object is about what was spoken of, not about everything on the table."""
    before = turn.last.structures
    if any(part.objects is None for part in before) or EVERYTHING.search(turn.said.said):
        return ""
    if any(part.objects is None for part in goal.structures):
        return "it does not say which objects it is about"
    return ""


def _contradicted(turn: Turn, goal: Goal) -> str:
    """An object has one place: "and the stone to the left of the pot, 6 cm away" is no second relation."""
    placed: dict[int, list[RelationPart]] = {}
    for part in goal.parts:
        if isinstance(part, RelationPart) and part.relation not in ("moved", "swapped", "at"):
            for one in objects_of(goal, part.objects):
                placed.setdefault(one, []).append(part)
    new = [part for part in goal.parts if part not in turn.last.parts]
    for parts in placed.values():
        if len(parts) > 1 and any(part in new for part in parts):
            return "an object would have two places"
    if not turn.built and any(_exchanges_named(turn.last, part) for part in new):
        return "its objects have a part each in the goal"
    inside = {one for part in turn.last.structures for one in objects_of(turn.last, part.objects)}
    exchanged = [set(_both(part)) for part in new if isinstance(part, RelationPart) and part.relation == "swapped"]
    if not turn.built and any(ends & inside and not ends <= inside for ends in exchanged):
        return "it is not clear whether one of them takes the other's part in the goal"
    for part in new:
        if isinstance(part, RelationPart) and part.relation in (*DIRECTIONAL, "next to") and _other_way_round(goal, part):
            return "two objects would each be at the same side of the other"
    for part in goal.structures:
        if part.along is not None and part in new and _against(part):
            return f"a line along the {part.along} edge is not at the {part.x_position or part.y_position}"
    return ""


def _unused_side(turn: Turn, goal: Goal) -> str:
    """Every side that is said stands in what changes: "the left side and the back" is not the left alone."""
    said = turn.said.said
    if NO_SIDE.search(said):
        return ""
    for first, end in sorted((one.span for one in (*turn.said.mentions, *turn.said.parts)), reverse=True):
        said = f"{said[:first]} {said[end:]}"
    values = " ".join(describe_part(part, None) for part in goal.parts if part not in turn.last.parts)
    for side, shown in SIDES.items():
        match = re.search(rf"\b(?:{side})\b", said)
        if match is not None and values and not re.search(shown, values):
            return f"{match.group()!r} would be left out"
    return ""


def _denied_object(turn: Turn, goal: Goal) -> str:
    """What a sentence says shall not be, does not stay all that it was: "blue ones, not red"."""
    said = turn.said.said
    for match in DENYING.finditer(said):
        starts = [one for one in turn.said.mentions if one.span[0] <= match.end() < one.span[1]]
        denied = {index for one in starts for index in one.indices}
        end = max((one.span[1] for one in starts), default=match.end())
        if not denied and (colour := re.compile(r"[a-z]+").match(said, end)) is not None:
            word, end = colour.group(), colour.end()
            denied = {n for n, each in enumerate(turn.said.objects) if word.removesuffix("s") in colors_of(each)}
        denied &= set(turn.last.named_objects())
        if RELATED_BY.match(said, end) or not denied:
            continue  # "not the cup on the plate" is about the relation
        if _uses(goal, denied) >= _uses(turn.last, denied):
            return f"{said[match.start() : end]!r} would change nothing"
    return ""


def _uses(goal: Goal, some: set[int]) -> int:
    """Return how often the parts of a goal name any of some objects."""
    ends = [part.reference if isinstance(part, RelationPart) else part.around for part in goal.parts]
    named = [one for objects in (*ends, *(part.objects for part in goal.parts)) for one in objects_of(goal, objects)]
    return sum(one in some for one in named)


def _of_the_goal(turn: Turn, goal: Goal) -> str:
    """A fragment can speak of the goal's own order, of its places, and of objects in it."""
    said, new = turn.said.said, [part for part in goal.parts if part not in turn.last.parts]
    if THAT_PLACE.search(said):
        return "it is not clear which place is meant"
    orders = any(VERBS.get(word, "leave") != "leave" for word in said.split())
    at = any(isinstance(part, RelationPart) and part.relation == "at" for part in new)
    if at and not orders and SUPERLATIVE.search(said) and any(part.order is not None for part in turn.last.structures):
        return "it may be about the order"
    return ""


def _unclear_one(turn: Turn, goal: Goal) -> str:
    """After a structure "the middle one" is one of its objects, and not the object in the middle of the table."""
    match = ONE_OF_A_ROW.search(turn.said.said)
    inside = {one for part in turn.last.structures for one in objects_of(turn.last, part.objects)}
    if match is None or not inside:
        return ""
    start, end = match.span()
    meant = [set(one.indices) for one in turn.said.mentions if one.span[0] < end and one.span[1] > start]
    new = [part for part in goal.parts if part not in turn.last.parts]
    used = {one for part in new if isinstance(part, RelationPart) for one in _both(part)}
    named = {one for said in turn.said.mentions if said.span[0] >= end or said.span[1] <= start for one in said.indices}
    if (used - named) - inside or not meant and used - named:
        return f"it is not clear which object {match.group()!r} is"
    return ""


def _half_new(turn: Turn, goal: Goal) -> str:
    """A relation of objects that the goal has is no new goal: "bottle before the jar" changes the order of the line."""
    exchanged = [set(_both(part)) for part in goal.parts if isinstance(part, RelationPart) and part.relation == "swapped"]
    for part in turn.last.structures if turn.open and not AFRESH.search(turn.said.said) else ():
        if any(ends <= set(objects_of(turn.last, part.objects)) for ends in exchanged):
            kind = part.shape or "structure"
            return f"the {kind} does not say where each of its objects stands; “scrap that, …” exchanges them on the table"
    alone = len(turn.last.parts) == 1 and isinstance(turn.last.parts[0], RelationPart)
    asks = any(VERBS.get(word, "leave") != "leave" for word in turn.said.said.split())
    if turn.built or alone or asks or AFRESH.search(turn.said.said):
        return ""
    known = set(turn.last.named_objects())
    for part in goal.parts:
        if isinstance(part, RelationPart) and known & set(_both(part)):
            return "it is not clear whether the goal changes, or another takes its place"
    return ""


def _exchanges_named(last: Goal, part: Part) -> bool:
    """Return whether a part exchanges the places of objects that the goal has something else for."""
    named = set(last.named_objects())
    if not isinstance(part, RelationPart) or part.relation != "swapped" or not set(_both(part)) <= named:
        return False
    inside = [one for one in last.structures if set(_both(part)) <= set(objects_of(last, one.objects))]
    return not inside or any(one.order is not None and one.order.by == "listed" for one in inside)


def _both(part: RelationPart) -> tuple[object, ...]:
    ends = (part.objects, part.reference)
    return tuple(one for each in ends if isinstance(each, tuple) for one in each)


def _other_way_round(goal: Goal, part: RelationPart) -> bool:
    """Return whether the goal also places the reference of a relation by its object, in the same direction."""
    return any(
        isinstance(other, RelationPart) and other.relation == part.relation
        and (other.objects, other.reference) == (part.reference, part.objects)
        for other in goal.parts
    )  # fmt: skip


def _against(part: StructurePart) -> bool:
    """Return whether a line's position is opposite to the edge that it goes along."""
    return (part.along, part.x_position) in (("left", "right"), ("right", "left")) or (
        (part.along, part.y_position) in (("near", "top"), ("far", "bottom"))
    )


def _unclear_loss(turn: Turn, goal: Goal) -> str:
    """A phrase for one object takes no more than one out of the goal."""
    lost = set(turn.last.named_objects()) - set(goal.named_objects())
    singular = [set(one.indices) for one in turn.said.mentions if not one.mention.plural]
    if not turn.said.parts and any(len(lost & each) > 1 for each in singular):
        return "it is not clear which of the objects would leave"
    return ""


def _unused_object(turn: Turn, goal: Goal) -> str:
    """Every object that is named has to do with what changes."""
    new = [part for part in goal.parts if part not in turn.last.parts]
    old = [part for part in turn.last.parts if part not in goal.parts]
    concerned: set[int] = set()
    for of, parts in ((goal, new), (turn.last, old)):
        for part in parts:
            concerned.update(objects_of(of, part.objects))
            concerned.update(objects_of(of, part.reference if isinstance(part, RelationPart) else part.around))
            if part.objects is None:
                return ""
    known = set(turn.last.named_objects())
    fewer = len(goal.parts) < len(turn.last.parts) or KEPT.search(turn.said.said) is not None
    for one in turn.said.mentions:
        if fewer and set(one.indices) <= known:
            continue  # what is said to stay as it is
        if one.indices and not concerned & set(one.indices):
            return f"{turn.said.said[slice(*one.span)]!r} would be left out"
    return ""
