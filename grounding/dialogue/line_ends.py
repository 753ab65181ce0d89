"""Put objects at an end of a line, an arc or a tower: "add the brick at the right end", "the bottle should be last"."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

from grounding.dialogue.goal_changes import numbered, with_part
from grounding.dialogue.goal_revision import PART, GoalRevision, Turn
from grounding.dialogue.object_exchanges import NamedObjects, sentence_template
from grounding.goals.description import describe_part
from grounding.goals.goal import Goal
from grounding.goals.parts import OPPOSITE_ENDS, SHAPES_OF_KEY, GoalError, Order, StructurePart
from grounding.parse_result import Question

_POLITE = (
    r"(?:(?:please|now|ok|okay|so|then|just|actually|no|nope|yes|yeah|well|sorry|wait|and|but|oh|also|i want|i'd like"
    r"|i meant?|i said|let|make|have|could you|can you|would you|the|my)[ ,]+)*"
)
_VERB = r"(?:(?:add|put|place|append|tack|stick|set|move|shift|slide|bring|take|attach)[ ,]+)?(?:the |my )?"
_AUXILIARY = (
    r"(?:[ ,]+(?:on|back|over|should(?: be| go| come| stand)?|must(?: be| go| come)?|has to (?:be|go|come)|goes|comes"
    r"|stands|is|to be))?"
)
_OF_IT = r"(?: of (?:<part>|it|them|that))?"
_SIDES = r"left|right|front|near|back|far|rear|top|bottom"
_END = (
    r"(?:(?:at|on|onto|to|in|as)[ ,]+)?(?:the |its )?(?:very )?"
    rf"(?:(?:far (?=left|right))?(?P<end>{_SIDES}|other|opposite)(?:[ -]?hand|[ -]?most)? end|(?P<last>end|tail|last(?: one)?)"
    rf"|(?P<first>beginning|start|head|first(?: one)?)){_OF_IT}"
    r"|(?:at |on |as )?(?:the )?(?P<most>left|right|front|rear)most(?: one)?(?: of (?:<part>|it|them))?"
    r"|(?:in|into|at) (?:the |its )?(?:very )?(?P<middle>middle|center|centre)(?: one)? of (?:<part>|it|them)"
    r"|(?P<between>between|in between) the other two(?: (?:ones|objects))?"
)
_TOWER_END = (
    r"(?:at|on|to)[ ,]+(?:the )?very (?P<end>top|bottom)(?: of (?:<part>|it))?|(?P<last>topmost)|(?P<first>bottommost)"
)
_AFTER = r"(?:[ ,]+(?:please|now|then|instead|rather|too|also|as well|after all|there|thanks))*[ .!]*"
_AT_AN_END = tuple(
    re.compile(rf"{_POLITE}{pattern}{_AFTER}")
    for end in (_END, _TOWER_END)
    for pattern in (
        rf"{_VERB}<0>{_AUXILIARY}[ ,]+(?:{end})",
        rf"(?:{end})(?:[ ,]+(?:comes|goes|is|put|add))?[ ,]+(?:the )?<0>",
    )
)
_ADDING = re.compile(r"\b(?:add|append|tack|stick|attach|also|too|as well)\b")
_START_OF = {
    "left": "left", "right": "right", "front": "near", "near": "near", "back": "far", "far": "far", "rear": "far",
    "top": "top", "bottom": "bottom",
}  # fmt: skip


def placed_at_an_end(turn: Turn) -> GoalRevision | None:
    """Return the goal in which objects stand at an end of a structure, which they join if they are not in it.

    The objects follow one another as listed then, because no other key says which object is at an end.

    Returns:
        `None` where the sentence says something else, or where no structure of the goal has ends.
    """
    template, named = sentence_template(turn)
    if len(named) != 1:
        return None
    match = next((found for pattern in _AT_AN_END if (found := pattern.fullmatch(template)) is not None), None)
    number = None if match is None else _with_ends(turn)
    if match is None or number is None:
        return None
    goal = turn.last.resolved(len(turn.said.objects))
    part = goal.parts[number]
    assert isinstance(part, StructurePart)  # `_with_ends` has looked
    placed = _placed(turn, goal, part, named[0])
    if not placed:
        return None
    where = numbered(turn.last, number, turn.said.names)
    if part.order is not None and part.order.by != "listed":
        message = f"{where} is ordered by {part.order.by}, which says what stands at its ends; say another order"
        return GoalRevision(turn.last, "refused", message=message)
    groups = match.groupdict()
    ends = _ends(part, placed, groups)
    found = [_at_end(part, placed, end) for end in ends]  # type: ignore[arg-type]
    if None in found or not found:
        return GoalRevision(turn.last, "refused", message=_no_such_place(part, where, ends))
    goals = list[Goal]()
    with suppress(GoalError):
        goals = [with_part(turn.last, number, each) for each in found if each is not None]
    return _answer(turn, number, goals, part)


def _with_ends(turn: Turn) -> int | None:
    """Return the structure that is spoken of, or the only one, if it can have an order."""
    spoken = [number for one in turn.said.parts for number in one.numbers]
    structures = [number for number, part in enumerate(turn.last.parts) if isinstance(part, StructurePart)]
    numbers = spoken or structures
    if len(numbers) != 1 or any(not one.numbers for one in turn.said.parts):
        return None
    part = turn.last.parts[numbers[0]]
    return numbers[0] if isinstance(part, StructurePart) and part.shape in SHAPES_OF_KEY["order"] else None


def _placed(turn: Turn, goal: Goal, part: StructurePart, named: NamedObjects) -> tuple[int, ...]:
    """Return the objects that are meant: of the structure, or free ones; none where that is not clear."""
    own = {one for one in part.objects or () if isinstance(one, int)}
    free = set(range(len(turn.said.objects))) - set(goal.named_objects())
    inside, outside = named.of(own), named.of(free)
    if _ADDING.search(turn.said.said):
        return outside if not inside or outside else inside
    if inside and set(named.indices) & free:
        return ()  # the one that is in it, or another one?
    if named.several and set(named.indices) not in (set(inside), set(outside)):
        return ()
    return inside or outside


def _ends(part: StructurePart, placed: tuple[int, ...], said: Mapping[str, str | None]) -> list[str]:
    """Return the ends that the named groups of a pattern may mean."""
    if said.get("middle") or said.get("between"):
        return ["middle"]
    if word := said.get("end") or said.get("most"):
        return [_START_OF[word]] if word in _START_OF else _other_ends(part, placed)
    return ["last" if said.get("last") else "first"]


def _other_ends(part: StructurePart, placed: tuple[int, ...]) -> list[str]:
    """Return the end that "the other end" is: opposite to where an object stands, otherwise either."""
    objects = part.objects or ()
    if part.order is not None and placed == objects[: len(placed)]:
        return ["last"]
    if part.order is not None and placed == objects[-len(placed) :]:
        return ["first"]
    upright = part.shape == "tower"
    return ["bottom", "top"] if upright else ["near", "far"] if part.along in ("left", "right") else ["left", "right"]


def _at_end(part: StructurePart, placed: tuple[int, ...], end: str) -> StructurePart | None:
    """Return a structure with objects at an end; `None` where its order has no such end."""
    others = tuple(one for one in part.objects or () if one not in placed)
    order = part.order or Order("listed")
    start = order.start
    if end in OPPOSITE_ENDS:
        if start is None:
            if (end in ("top", "bottom")) != (part.shape == "tower"):
                return None
            # Listed from the end that is said, so that the goal names it.
            turned = others[::-1] if end in ("right", "far", "top") else others
            return replace(part, order=Order("listed", None, end), objects=(*placed, *turned))  # type: ignore[arg-type]
        if end not in (start, OPPOSITE_ENDS[start]):
            return None
        end = "first" if end == start else "last"
    if end == "middle":
        half, odd = divmod(len(others), 2)
        return None if odd else replace(part, order=order, objects=(*others[:half], *placed, *others[half:]))  # type: ignore[arg-type]
    objects = (*placed, *others) if end == "first" else (*others, *placed)
    return replace(part, order=order, objects=objects)  # type: ignore[arg-type]


def _no_such_place(part: StructurePart, where: str, ends: list[str]) -> str:
    if ends == ["middle"]:
        return f"{where} would have an even number of objects, so that none stands in its middle"
    if part.order is not None and part.order.start is not None:
        return f"{where} has no such end: its order is given from {part.order.start}"
    return f"{where} has no such end"


def _answer(turn: Turn, number: int, goals: list[Goal], before: StructurePart) -> GoalRevision | None:
    names = turn.said.names
    if len(goals) == 1:
        part = goals[0].parts[number]
        if part == turn.last.parts[number]:
            return GoalRevision(turn.last, "unchanged", message=f"that is so already: {describe_part(part, names)}")
        note = "" if before.order is not None else f"the order of all is fixed now: {_listed(part, names)}"
        return GoalRevision(goals[0], "ok", "edit", note, (number,))
    if not goals:
        return None
    options = tuple(describe_part(goal.parts[number], names) for goal in goals)
    question = Question(PART, f"which end is meant: {'; '.join(options)}?", options)
    return GoalRevision(turn.last, "ask", "edit", question.text, question=question, choices=tuple(goals))


def _listed(part: StructurePart, names: Sequence[str]) -> str:
    return ", ".join(names[one] for one in part.objects or () if isinstance(one, int))
